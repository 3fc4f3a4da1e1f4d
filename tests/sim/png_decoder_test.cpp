#include "sim/png_decoder.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "core/random.h"
#include "sim/png_encoder.h"

namespace diorama {
namespace {

// Something of everything: ramps, steps, noise.
cv::Mat picture(int type, int width, int height) {
  const Random random(3, RandomStream::kTest);
  cv::Mat image(height, width, type);
  const int bytes = width * static_cast<int>(image.elemSize());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < bytes; ++x) {
      const uint32_t bits = random.bits(static_cast<uint32_t>(y), static_cast<uint64_t>(x))[0];
      const int smooth = x / 3 + 2 * y + (x > bytes / 2 ? 90 : 0);
      image.ptr<uint8_t>(y)[x] =
          static_cast<uint8_t>(y % 7 == 0 ? bits : static_cast<uint32_t>(smooth) + bits % 4);
    }
  return image;
}

std::string encode(const cv::Mat& image, int strategy) {
  std::vector<uint8_t> bytes;
  cv::imencode(".png", image, bytes, {cv::IMWRITE_PNG_STRATEGY, strategy});
  return {bytes.begin(), bytes.end()};
}

template <class T>
void expectSame(const cv::Mat& image, const std::optional<PngImage>& decoded) {
  ASSERT_TRUE(decoded.has_value());
  ASSERT_TRUE(std::holds_alternative<Image<T>>(*decoded));
  const auto& out = std::get<Image<T>>(*decoded);
  ASSERT_EQ(out.width, image.cols);
  ASSERT_EQ(out.height, image.rows);
  for (int y = 0; y < image.rows; ++y)
    for (int x = 0; x < image.cols; ++x) {
      if constexpr (std::is_same_v<T, Rgb8>) {
        const auto& v = image.at<cv::Vec3b>(y, x);
        ASSERT_EQ(out(x, y), (Rgb8{v[2], v[1], v[0]})) << x << " " << y;
      } else {
        ASSERT_EQ(out(x, y), image.at<T>(y, x)) << x << " " << y;
      }
    }
}

// libpng chooses the filters of rows by the strategy.
TEST(PngDecoder, ReadsWhatOthersWrite) {
  for (int strategy = 0; strategy <= 4; ++strategy)
    for (const auto& [width, height] : {std::pair{64, 48}, {1, 1}, {3, 200}, {201, 2}}) {
      const cv::Mat color = picture(CV_8UC3, width, height), grey = picture(CV_8UC1, width, height),
                    wide = picture(CV_16UC1, width, height);
      expectSame<Rgb8>(color, decodePng(encode(color, strategy)));
      expectSame<uint8_t>(grey, decodePng(encode(grey, strategy)));
      expectSame<uint16_t>(wide, decodePng(encode(wide, strategy)));
    }
}

TEST(PngDecoder, ReadsWhatWeWrite) {
  const cv::Mat image = picture(CV_8UC3, 80, 60);
  Image<Rgb8> ours(80, 60);
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 80; ++x) {
      const auto& v = image.at<cv::Vec3b>(y, x);
      ours(x, y) = {v[2], v[1], v[0]};
    }
  expectSame<Rgb8>(image, decodePng(encodePng(ours)));
}

TEST(PngDecoder, LeavesOtherKindsToOthers) {
  EXPECT_FALSE(decodePng(encode(picture(CV_8UC4, 8, 8), 0)).has_value());
  EXPECT_FALSE(decodePng(encode(picture(CV_16UC3, 8, 8), 0)).has_value());
  EXPECT_FALSE(decodePng("").has_value());
  EXPECT_FALSE(decodePng("GIF89a").has_value());
}

// Neither a cut nor a changed byte may lead to more than "nothing" or an image of the same size.
TEST(PngDecoder, SurvivesWhatIsBroken) {
  const std::string whole = encode(picture(CV_8UC3, 16, 12), 0);
  for (size_t length = 0; length < whole.size(); ++length)
    EXPECT_FALSE(decodePng(std::string_view(whole).substr(0, length)).has_value()) << length;
  for (size_t at = 0; at < whole.size(); ++at)
    for (const int flip : {1, 0x20, 0xff}) {
      std::string broken = whole;
      broken[at] = static_cast<char>(broken[at] ^ flip);
      const std::optional<PngImage> image = decodePng(broken);
      if (image && std::holds_alternative<Image<Rgb8>>(*image)) {
        EXPECT_LE(std::get<Image<Rgb8>>(*image).pixels.size(), 16u * 12u);
      }
    }
}

}  // namespace
}  // namespace diorama
