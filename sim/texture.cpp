#include "sim/texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "core/errors.h"
#include "core/files.h"

namespace diorama {
namespace {

constexpr int kMaxLogSize = 12;

float srgbToLinear(int value) {  // IEC 61966-2-1
  const float s = static_cast<float>(value) / 255.f;
  return s <= 0.04045f ? s / 12.92f : std::pow((s + 0.055f) / 1.055f, 2.4f);
}

cv::Mat toLinear(const cv::Mat& srgb) {
  std::array<float, 256> table{};
  for (int i = 0; i < 256; ++i) table[static_cast<size_t>(i)] = srgbToLinear(i);
  cv::Mat linear(srgb.rows, srgb.cols, CV_32FC3);
  for (int y = 0; y < srgb.rows; ++y) {
    const uint8_t* from = srgb.ptr<uint8_t>(y);
    float* to = linear.ptr<float>(y);
    for (int k = 0; k < 3 * srgb.cols; ++k) to[k] = table[from[k]];
  }
  return linear;
}

int nearestLog(int size) {
  const int log = static_cast<int>(std::lround(std::log2(static_cast<double>(size)) + 0.2));
  return std::clamp(log, 0, kMaxLogSize);
}

void append(const cv::Mat& rgb, std::vector<uint32_t>& texels) {
  const auto encode = [](float linear) {
    return static_cast<uint32_t>(255 * std::sqrt(std::clamp(linear, 0.f, 1.f)) + 0.5f);
  };
  for (int y = 0; y < rgb.rows; ++y)
    for (int x = 0; x < rgb.cols; ++x) {
      const cv::Vec3f& c = rgb.at<cv::Vec3f>(y, x);
      texels.push_back(encode(c[0]) | encode(c[1]) << 8 | encode(c[2]) << 16);
    }
}

// `linear` is RGB with the top row first.
Texture addLevels(cv::Mat linear, std::vector<uint32_t>& texels) {
  Texture texture;
  texture.base = static_cast<int>(texels.size());
  texture.log_width = nearestLog(linear.cols);
  texture.log_height = nearestLog(linear.rows);
  const cv::Size size(1 << texture.log_width, 1 << texture.log_height);
  if (size != linear.size()) {
    const bool shrinks = size.width <= linear.cols && size.height <= linear.rows;
    cv::resize(linear, linear, size, 0, 0, shrinks ? cv::INTER_AREA : cv::INTER_LINEAR);
  }
  cv::flip(linear, linear, 0);
  for (int level = 0;; ++level) {
    append(linear, texels);
    if (level == texture.lastLevel()) return texture;
    cv::resize(linear, linear, cv::Size(linear.cols / 2, linear.rows / 2), 0, 0, cv::INTER_AREA);
  }
}

}  // namespace

TextureAtlas::TextureAtlas() { add(Image<Rgb8>(1, 1, Rgb8{255, 255, 255})); }

int TextureAtlas::add(const std::filesystem::path& file) {
  if (const auto known = known_.find(file); known != known_.end()) return known->second;
  const std::string content = readFile(file);
  cv::Mat image;
  try {
    if (!content.empty())
      image = cv::imdecode(
          cv::Mat(1, static_cast<int>(content.size()), CV_8UC1, const_cast<char*>(content.data())),
          cv::IMREAD_COLOR);
  } catch (const cv::Exception&) {
    image.release();
  }
  if (image.empty()) throw InputError(file, "cannot be read as an image");
  cv::cvtColor(image, image, cv::COLOR_BGR2RGB);
  textures_.push_back(addLevels(toLinear(image), texels_));
  return known_[file] = static_cast<int>(textures_.size()) - 1;
}

int TextureAtlas::add(const Image<Rgb8>& srgb) {
  const cv::Mat image(srgb.height, srgb.width, CV_8UC3, const_cast<Rgb8*>(srgb.pixels.data()));
  textures_.push_back(addLevels(toLinear(image), texels_));
  return static_cast<int>(textures_.size()) - 1;
}

}  // namespace diorama
