#include "sim/png_encoder.h"

#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>

#include "core/random.h"

namespace diorama {
namespace {

cv::Mat decode(const std::string& png) {
  const std::vector<uint8_t> bytes(png.begin(), png.end());
  return cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
}

template <class T>
void expectSame(const Image<T>& image, const std::string& png) {
  const cv::Mat decoded = decode(png);
  ASSERT_EQ(decoded.cols, image.width);
  ASSERT_EQ(decoded.rows, image.height);
  ASSERT_EQ(decoded.elemSize(), sizeof(T));
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      if constexpr (std::is_same_v<T, Rgb8>) {
        const cv::Vec3b& v = decoded.at<cv::Vec3b>(y, x);
        ASSERT_EQ((Rgb8{v[2], v[1], v[0]}), image(x, y)) << x << " " << y;
      } else if constexpr (std::is_same_v<T, Rgb16>) {
        const cv::Vec3w& v = decoded.at<cv::Vec3w>(y, x);
        ASSERT_EQ((Rgb16{v[2], v[1], v[0]}), image(x, y)) << x << " " << y;
      } else {
        ASSERT_EQ(decoded.at<T>(y, x), image(x, y)) << x << " " << y;
      }
    }
}

const Random kRandom(1, RandomStream::kTest);
uint32_t noise(int x, int y) {
  return kRandom.bits(0, static_cast<uint64_t>(y) * 10000 + static_cast<uint64_t>(x))[0];
}

TEST(PngEncoder, LabelsAndDepthReadBack) {
  for (auto [width, height] :
       {std::pair{1, 1}, {2, 3}, {640, 480}, {257, 31}, {1, 700}, {900, 1}}) {
    Image<uint16_t> depth(width, height), ids(width, height), random(width, height);
    Image<uint8_t> mask(width, height);
    Image<Rgb16> flow(width, height);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        depth(x, y) = static_cast<uint16_t>(x > 100 && x < 300 ? 3000 + 3 * x + y : 9000 + 2 * y);
        ids(x, y) = static_cast<uint16_t>((x / 50 + y / 40) % 7 * 300);
        random(x, y) = static_cast<uint16_t>(noise(x, y));
        if (x > 40) flow(x, y) = {random(x, y), depth(x, y), static_cast<uint16_t>(y % 2)};
        mask(x, y) = (x - 300) * (x - 300) + (y - 200) * (y - 200) < 10000 ? 255 : 0;
      }
    expectSame(depth, encodePng(depth));
    expectSame(ids, encodePng(ids));
    expectSame(random, encodePng(random));
    expectSame(flow, encodePng(flow));
    expectSame(mask, encodePng(mask, PngContent::kLabels));
    expectSame(mask, encodePng(mask));
    if (width == 640) {
      EXPECT_LT(encodePng(mask, PngContent::kLabels).size(), 8000u);
    }
  }
}

TEST(PngEncoder, NoisyPicturesReadBackAndShrink) {
  Image<Rgb8> image(640, 480);
  for (int y = 0; y < 480; ++y)
    for (int x = 0; x < 640; ++x) {
      const uint32_t n = noise(x, y);
      const auto level = [&](int shift) {
        return static_cast<uint8_t>(60 + x / 8 + y / 16 + (n >> shift & 7));
      };
      image(x, y) = {level(0), level(3), level(6)};
    }
  const std::string png = encodePng(image);
  expectSame(image, png);
  EXPECT_LT(png.size(), 640u * 480u * 3u * 6 / 10);
}

// Counts that grow like Fibonacci numbers make the deepest Huffman trees.
TEST(PngEncoder, SkewedCountsStayWithinDeflatesCodeLength) {
  Image<uint8_t> image(1500, 1500);
  size_t a = 1, b = 1, at = 0;
  for (uint8_t value = 0; at < image.pixels.size(); ++value) {
    for (size_t i = 0; i < a && at < image.pixels.size(); ++i, ++at)
      image.pixels[(at * 7919) % image.pixels.size()] = static_cast<uint8_t>(value * 37);
    const size_t next = a + b;
    a = b, b = next;
  }
  expectSame(image, encodePng(image, PngContent::kLabels));
  expectSame(image, encodePng(image));
}

}  // namespace
}  // namespace diorama
