#include "sim/sensor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "sim/simd.h"

namespace diorama {
namespace {

using simd::Float8;
using simd::Int8;

constexpr int kQuantiles = 4096;
constexpr double kResponseGain = 2.2;  // light at full well on the scale of the curve's fit

// Inverse of the normal distribution's CDF at the middle of each of kQuantiles equal shares.
std::vector<float> normalQuantiles() {
  std::vector<float> result(kQuantiles);
  for (int i = 0; i < kQuantiles; ++i) {
    const double p = (i + 0.5) / kQuantiles;
    double low = -6, high = 6;
    for (int k = 0; k < 50; ++k) {
      const double middle = (low + high) / 2;
      (0.5 * std::erfc(-middle / std::sqrt(2.0)) < p ? low : high) = middle;
    }
    result[static_cast<size_t>(i)] = static_cast<float>((low + high) / 2);
  }
  return result;
}

Int8 levels(Float8 light) {
  return simd::toInt(simd::sqrt(simd::clamp(light, 0, 1)) * float{ResponseCurve::kLevels} + 0.5f);
}

double vignette(const Camera& camera, double loss, int x, int y) {
  // A smooth fall with the square of the distance from the principal point, `loss` in the corner
  // farthest from the middle of a centred image.
  const CameraParameters& k = camera.parameters();
  const double half = std::hypot(k.width, k.height) / 2;
  const double r = std::hypot(x - k.cx, y - k.cy) / half;
  return 1 - loss * std::min(1.0, r * r);
}

}  // namespace

namespace {

double srgbCurve(double light) {
  return light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1 / 2.4) - 0.055;
}

}  // namespace

double ResponseCurve::unscaled(double light) const {
  if (kind_ == "linear") return light;
  if (kind_ == "gamma") return std::pow(light, 1 / gamma_);
  if (kind_ == "srgb") return srgbCurve(light);
  const double x = light * kResponseGain;
  return srgbCurve(std::clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0));
}

double ResponseCurve::evaluate(double light) const {
  return std::min(1.0, unscaled(std::clamp(light, 0.0, 1.0)) / white_);
}

ResponseCurve::ResponseCurve(const EffectsOptions& effects)
    : kind_(effects.response), gamma_(effects.gamma) {
  white_ = unscaled(1);
  for (int i = 0; i <= kLevels; ++i) {
    const double root = static_cast<double>(i) / kLevels;
    table_.push_back(static_cast<int>(std::lround(255 * evaluate(root * root))));
  }
}

Sensor::Sensor(const Camera& camera, const EffectsOptions& effects, uint64_t seed)
    : effects_(effects),
      random_(seed, RandomStream::kSensorNoise),
      response_(effects),
      width_(camera.width()),
      normal_(normalQuantiles()) {
  for (int y = 0; y < camera.height(); ++y)
    for (int x = 0; x < camera.width(); ++x)
      vignette_.push_back(static_cast<float>(vignette(camera, effects.vignette, x, y)));
}

Image<Rgb8> Sensor::expose(const Image<Radiance>& radiance, const std::vector<Vector3d>& gain,
                           int frame, WorkerPool& pool) const {
  Image<Rgb8> out(radiance.width, radiance.height);
  constexpr int kRows = 16;
  pool.run((radiance.height + kRows - 1) / kRows, [&](int job) {
    for (int y = job * kRows; y < std::min(radiance.height, (job + 1) * kRows); ++y)
      exposeRow(radiance, gain[std::min(static_cast<size_t>(y), gain.size() - 1)], frame, y, out);
  });
  return out;
}

// Photons arrive at random: their number's deviation is its square root.
Float8 Sensor::withNoise(Float8 light, Int8 quantile) const {
  const auto full_well = static_cast<float>(effects_.full_well_e);
  const float read = static_cast<float>(effects_.read_noise_e) / full_well;
  const Float8 sigma = simd::sqrt(simd::max(light, simd::splat(0.f)) / full_well + read * read);
  return light + sigma * simd::gather(normal_.data(), quantile);
}

// Places in normal_ for `count` times eight numbers: eight draws of 128 bits serve eight of them.
std::vector<Int8> Sensor::drawQuantiles(int frame, int y, size_t count) const {
  const uint64_t draws = (count + 7) / 8 * 8;
  std::vector<Int8> quantiles(draws);
  for (size_t d = 0; d < draws; d += 8) {
    const auto bits =
        random_.bitsOfEight(static_cast<uint32_t>(frame), static_cast<uint64_t>(y) * draws + d);
    for (size_t word = 0; word < 4; ++word) {
      Int8 v;
      std::memcpy(&v, bits[word].data(), sizeof v);
      quantiles[d + 2 * word] = v & (kQuantiles - 1);
      quantiles[d + 2 * word + 1] = (v >> 16) & (kQuantiles - 1);
    }
  }
  return quantiles;
}

// The row is one list of numbers, red, green and blue of each pixel in turn. Eight pixels are three
// vectors.
void Sensor::exposeRow(const Image<Radiance>& radiance, const Vector3d& gain, int frame, int y,
                       Image<Rgb8>& out) const {
  Float8 channel_gain[3];
  for (int i = 0; i < 24; ++i) channel_gain[i / 8][i % 8] = static_cast<float>(gain[i % 3]);
  const int groups = (width_ + 7) / 8;
  std::vector<Int8> quantiles;
  if (effects_.noise) quantiles = drawQuantiles(frame, y, 3 * static_cast<size_t>(groups));
  const float* light = &radiance.row(y)->r;
  uint8_t* pixels = &out.row(y)->r;
  const float* vignette = vignette_.data() + static_cast<size_t>(y) * static_cast<size_t>(width_);
  for (int g = 0; g < groups; ++g) {
    const auto count = static_cast<size_t>(std::min(8, width_ - 8 * g));
    std::array<float, 24> values{};
    std::array<float, 8> gains{};
    std::memcpy(values.data(), light + 24 * g, 3 * count * sizeof(float));
    std::memcpy(gains.data(), vignette + 8 * g, count * sizeof(float));
    const Float8 by_pixel = simd::load(gains.data());
    const Float8 by_value[3] = {__builtin_shuffle(by_pixel, Int8{0, 0, 0, 1, 1, 1, 2, 2}),
                                __builtin_shuffle(by_pixel, Int8{2, 3, 3, 3, 4, 4, 4, 5}),
                                __builtin_shuffle(by_pixel, Int8{5, 5, 6, 6, 6, 7, 7, 7})};
    std::array<uint8_t, 24> coded{};
    for (int part = 0; part < 3; ++part) {
      const Float8 v = simd::load(values.data() + 8 * part) * by_value[part] * channel_gain[part];
      const auto vector = static_cast<size_t>(3 * g + part);
      const Int8 code = response_[levels(effects_.noise ? withNoise(v, quantiles[vector]) : v)];
      for (size_t i = 0; i < 8; ++i)
        coded[8 * static_cast<size_t>(part) + i] = static_cast<uint8_t>(code[i]);
    }
    std::memcpy(pixels + 24 * g, coded.data(), 3 * count);
  }
}

}  // namespace diorama
