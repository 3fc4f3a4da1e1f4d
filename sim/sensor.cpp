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
      normal_(normalQuantiles()),
      photon_variance_(static_cast<float>(1 / effects.full_well_e)),
      read_variance_(static_cast<float>(std::pow(effects.read_noise_e / effects.full_well_e, 2))) {
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
inline Float8 Sensor::withNoise(Float8 light, Int8 quantile) const {
  const Float8 variance = simd::max(light, simd::splat(0.f)) * photon_variance_ + read_variance_;
  const Float8 sigma = simd::sqrt(variance);
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

// `light` is one list of numbers, red, green and blue of each pixel in turn: eight pixels are three
// vectors, and so are `gain` and `quantiles`, which may be missing. `vignette` is one a pixel.
inline void Sensor::exposeEight(const float* light, const float* vignette, const Float8* gain,
                                const Int8* quantiles, uint8_t* pixels) const {
  const Float8 by_pixel = simd::load(vignette);
  const Float8 by_value[3] = {__builtin_shuffle(by_pixel, Int8{0, 0, 0, 1, 1, 1, 2, 2}),
                              __builtin_shuffle(by_pixel, Int8{2, 3, 3, 3, 4, 4, 4, 5}),
                              __builtin_shuffle(by_pixel, Int8{5, 5, 6, 6, 6, 7, 7, 7})};
  for (int k = 0; k < 3; ++k) {
    const Float8 v = simd::load(light + 8 * k) * by_value[k] * gain[k];
    simd::storeBytes(pixels + 8 * k,
                     response_[levels(quantiles != nullptr ? withNoise(v, quantiles[k]) : v)]);
  }
}

void Sensor::exposeRow(const Image<Radiance>& radiance, const Vector3d& gain, int frame, int y,
                       Image<Rgb8>& out) const {
  Float8 channel_gain[3];
  for (int i = 0; i < 24; ++i) channel_gain[i / 8][i % 8] = static_cast<float>(gain[i % 3]);
  const auto groups = static_cast<size_t>((width_ + 7) / 8),
             whole = static_cast<size_t>(width_ / 8);
  std::vector<Int8> quantiles;
  if (effects_.noise) quantiles = drawQuantiles(frame, y, 3 * groups);
  const auto drawn = [&](size_t g) { return effects_.noise ? &quantiles[3 * g] : nullptr; };
  const float* light = &radiance.row(y)->r;
  uint8_t* pixels = &out.row(y)->r;
  const float* vignette = vignette_.data() + static_cast<size_t>(y) * static_cast<size_t>(width_);
  for (size_t g = 0; g < whole; ++g)
    exposeEight(light + 24 * g, vignette + 8 * g, channel_gain, drawn(g), pixels + 24 * g);
  if (whole == groups) return;
  const auto rest = static_cast<size_t>(width_ % 8);
  std::array<float, 24> some_light{};
  std::array<float, 8> some_vignette{};
  std::array<uint8_t, 24> some_pixels{};
  std::copy_n(light + 24 * whole, 3 * rest, some_light.data());
  std::copy_n(vignette + 8 * whole, rest, some_vignette.data());
  exposeEight(some_light.data(), some_vignette.data(), channel_gain, drawn(whole),
              some_pixels.data());
  std::copy_n(some_pixels.data(), 3 * rest, pixels + 24 * whole);
}

}  // namespace diorama
