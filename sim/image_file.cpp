#include "sim/image_file.h"

#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "core/errors.h"
#include "core/files.h"
#include "sim/png_decoder.h"
#include "sim/png_encoder.h"

namespace diorama {
namespace {

uint32_t bigEndian(std::string_view bytes, size_t at) {
  uint32_t value = 0;
  for (size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<uint8_t>(bytes[at + i]);
  return value;
}

std::string wrongSize(int64_t width, int64_t height, int expected_width, int expected_height) {
  return "the image has " + std::to_string(width) + "x" + std::to_string(height) +
         " pixels, the camera " + std::to_string(expected_width) + "x" +
         std::to_string(expected_height);
}

// Walks the chunks of a PNG: their lengths and checksums, and the size in the header.
std::optional<std::string> pngProblem(std::string_view bytes, int width, int height) {
  size_t at = 8;
  while (at + 12 <= bytes.size()) {
    const size_t length = bigEndian(bytes, at);
    if (length > bytes.size() - at - 12) break;
    const std::string_view typed = bytes.substr(at + 4, length + 4);
    if (pngChecksum(typed) != bigEndian(bytes, at + 8 + length))
      return "the image is broken (a wrong checksum)";
    if (typed.starts_with("IHDR") && length >= 8) {
      const uint32_t w = bigEndian(bytes, at + 8), h = bigEndian(bytes, at + 12);
      if (w != static_cast<uint32_t>(width) || h != static_cast<uint32_t>(height))
        return wrongSize(w, h, width, height);
    }
    if (typed.starts_with("IEND")) return std::nullopt;
    at += length + 12;
  }
  return "the image is cut short";
}

std::optional<std::string> problem(std::string_view bytes, int width, int height) {
  if (bytes.empty()) return "the image is empty";
  if (bytes.starts_with("\x89PNG\r\n\x1a\n")) return pngProblem(bytes, width, height);
  if (bytes.starts_with("\xff\xd8") && bytes.rfind("\xff\xd9") == std::string_view::npos)
    return "the image is cut short";
  return std::nullopt;
}

cv::Mat decode(const std::string& bytes) {
  try {
    const cv::Mat buffer(1, static_cast<int>(bytes.size()), CV_8UC1,
                         const_cast<char*>(bytes.data()));
    return cv::imdecode(buffer, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {
    return {};
  }
}

template <class T>
Image<T> copyGray(const cv::Mat& image) {
  Image<T> out(image.cols, image.rows);
  for (int y = 0; y < image.rows; ++y)
    std::copy(image.ptr<T>(y), image.ptr<T>(y) + image.cols, out.row(y));
  return out;
}

// Blue, green, red (and alpha) of `T` to 8-bit colour.
template <class T>
Image<Rgb8> copyColor(const cv::Mat& image) {
  constexpr uint32_t kMax = std::numeric_limits<T>::max();
  const auto to8 = [](T v) {
    if constexpr (sizeof(T) == 1) return v;  // what follows is the same, but slow
    return static_cast<uint8_t>((v * 255u + kMax / 2) / kMax);
  };
  const int channels = image.channels();
  Image<Rgb8> out(image.cols, image.rows);
  for (int y = 0; y < image.rows; ++y) {
    const T* in = image.ptr<T>(y);
    for (int x = 0; x < image.cols; ++x, in += channels)
      out(x, y) = {to8(in[2]), to8(in[1]), to8(in[0])};
  }
  return out;
}

Image<uint8_t> toEightBits(const Image<uint16_t>& image) {
  Image<uint8_t> out(image.width, image.height);
  for (size_t i = 0; i < image.pixels.size(); ++i)
    out.pixels[i] = static_cast<uint8_t>((image.pixels[i] * 255u + 32767u) / 65535u);
  return out;
}

cv::Mat decodeFile(const std::filesystem::path& file, const std::string& bytes) {
  const cv::Mat image = decode(bytes);
  if (image.empty()) throw InputError(file, "is no image that can be read");
  return image;
}

// Of a file that was looked at from outside.
std::string checkedBytes(const std::filesystem::path& file, int width, int height) {
  std::string bytes = readFile(file);
  if (const std::optional<std::string> what = problem(bytes, width, height))
    throw InputError(file, *what);
  return bytes;
}

cv::Mat checkedImage(const std::filesystem::path& file, const std::string& bytes, int width,
                     int height) {
  const cv::Mat image = decodeFile(file, bytes);
  if (image.cols != width || image.rows != height)
    throw InputError(file, wrongSize(image.cols, image.rows, width, height));
  return image;
}

}  // namespace

AnyImage readImage(const std::filesystem::path& file, int width, int height) {
  const std::string bytes = checkedBytes(file, width, height);
  if (std::optional<PngImage> image = decodePng(bytes))
    return std::visit([](auto& same) { return AnyImage(std::move(same)); }, *image);
  const cv::Mat image = checkedImage(file, bytes, width, height);
  const int depth = image.depth(), channels = image.channels();
  if ((depth != CV_8U && depth != CV_16U) || channels == 2 || channels > 4)
    throw InputError(file, "is neither a grey nor a colour image of 8 or 16 bits");
  if (channels == 1)
    return depth == CV_8U ? AnyImage(copyGray<uint8_t>(image)) : copyGray<uint16_t>(image);
  return depth == CV_8U ? copyColor<uint8_t>(image) : copyColor<uint16_t>(image);
}

Image<Rgb16> readWideColor(const std::filesystem::path& file, int width, int height) {
  const cv::Mat image = checkedImage(file, checkedBytes(file, width, height), width, height);
  if (image.type() != CV_16UC3) throw InputError(file, "is no colour image of 16 bits");
  Image<Rgb16> out(width, height);
  for (int y = 0; y < height; ++y) {
    const uint16_t* in = image.ptr<uint16_t>(y);
    for (int x = 0; x < width; ++x, in += 3) out(x, y) = {in[2], in[1], in[0]};
  }
  return out;
}

ImageSize imageSize(const std::filesystem::path& file) {
  const cv::Mat image = decodeFile(file, readFile(file));
  return {image.cols, image.rows};
}

Frame readFrame(const std::filesystem::path& file, const Camera& camera) {
  Frame frame;
  AnyImage image = readImage(file, camera.width(), camera.height());
  if (auto* rgb = std::get_if<Image<Rgb8>>(&image)) {
    frame.rgb = std::move(*rgb);
    frame.gray = toGray(frame.rgb);
  } else if (auto* gray = std::get_if<Image<uint8_t>>(&image)) {
    frame.gray = std::move(*gray);
  } else {
    frame.gray = toEightBits(std::get<Image<uint16_t>>(image));
  }
  return frame;
}

}  // namespace diorama
