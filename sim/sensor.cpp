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
constexpr double kBrightGrey = 0.16;   // of the full well, for the 80th percentile
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

double vignette(const Camera& camera, double loss, int x, int y) {
  // A smooth fall with the square of the distance from the principal point, `loss` in the corner
  // farthest from the middle of a centred image.
  const CameraParameters& k = camera.parameters();
  const double half = std::hypot(k.width, k.height) / 2;
  const double r = std::hypot(x - k.cx, y - k.cy) / half;
  return 1 - loss * std::min(1.0, r * r);
}

}  // namespace

double ResponseCurve::evaluate(double light) {
  const double x = std::clamp(light, 0.0, 1.0) * kResponseGain;
  const double y = std::clamp(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0);
  return y <= 0.0031308 ? 12.92 * y : 1.055 * std::pow(y, 1 / 2.4) - 0.055;
}

ResponseCurve::ResponseCurve() {
  const double white = evaluate(1);
  for (int i = 0; i <= kLevels; ++i) {
    const double root = static_cast<double>(i) / kLevels;
    table_.push_back(
        static_cast<uint8_t>(std::lround(255 * std::min(1.0, evaluate(root * root) / white))));
  }
}

Sensor::Sensor(const Camera& camera, const EffectsOptions& effects, double exposure, uint64_t seed)
    : effects_(effects),
      random_(seed, RandomStream::kSensorNoise),
      width_(camera.width()),
      normal_(normalQuantiles()) {
  for (int y = 0; y < camera.height(); ++y)
    for (int x = 0; x < camera.width(); ++x)
      gain_.push_back(static_cast<float>(exposure * vignette(camera, effects.vignette, x, y)));
}

Image<Rgb8> Sensor::expose(const Image<Radiance>& radiance, int frame, WorkerPool& pool) const {
  Image<Rgb8> out(radiance.width, radiance.height);
  constexpr int kRows = 16;
  pool.run((radiance.height + kRows - 1) / kRows, [&](int job) {
    for (int y = job * kRows; y < std::min(radiance.height, (job + 1) * kRows); ++y)
      exposeRow(radiance, frame, y, out);
  });
  return out;
}

// The row is one list of numbers, red, green and blue of each pixel in turn; eight at a time share
// one draw of 128 random bits, 16 for each.
void Sensor::exposeRow(const Image<Radiance>& radiance, int frame, int y, Image<Rgb8>& out) const {
  const auto values = 3 * static_cast<size_t>(width_);
  const float* light = &radiance.row(y)->r;
  uint8_t* pixels = &out.row(y)->r;
  const float* gain = gain_.data() + static_cast<size_t>(y) * static_cast<size_t>(width_);
  const auto full_well = static_cast<float>(effects_.full_well_e);
  const auto read = static_cast<float>(effects_.read_noise_e) / full_well;
  const size_t groups = (values + 7) / 8;
  for (size_t g = 0; g < groups; ++g) {
    const size_t first = 8 * g, count = std::min<size_t>(8, values - first);
    std::array<float, 8> source{}, pixel_gain{}, noise{};
    std::copy_n(light + first, count, source.begin());
    for (size_t i = 0; i < count; ++i) pixel_gain[i] = gain[(first + i) / 3];
    Float8 v = simd::load(source.data()) * simd::load(pixel_gain.data());
    if (effects_.noise) {
      const auto bits =
          random_.bits(static_cast<uint32_t>(frame), static_cast<uint64_t>(y) * groups + g);
      for (size_t i = 0; i < 8; ++i)
        noise[i] = normal_[(bits[i / 2] >> (16 * (i % 2)) & 0xffff) * kQuantiles >> 16];
      const Float8 sigma = simd::sqrt(simd::max(v, simd::splat(0.f)) / full_well + read * read);
      v = v + sigma * simd::load(noise.data());
    }
    const Int8 level =
        simd::toInt(simd::sqrt(simd::clamp(v, 0, 1)) * float{ResponseCurve::kLevels} + 0.5f);
    for (size_t i = 0; i < count; ++i) pixels[first + i] = response_[level[static_cast<int>(i)]];
  }
}

double chooseExposure(const std::vector<Image<Radiance>>& pictures) {
  std::vector<float> light;
  for (const Image<Radiance>& picture : pictures)
    for (const Radiance& p : picture.pixels)
      if (const float l = 0.2126f * p.r + 0.7152f * p.g + 0.0722f * p.b; l > 0) light.push_back(l);
  if (light.empty()) return 1;
  const auto rank = light.begin() + static_cast<std::ptrdiff_t>(light.size() * 8 / 10);
  std::nth_element(light.begin(), rank, light.end());
  return kBrightGrey / static_cast<double>(*rank);
}

}  // namespace diorama
