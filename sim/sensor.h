// From the light that arrives to 8-bit pixels: vignette, exposure, photon and read noise in linear
// light, response curve.
#pragma once

#include <cstdint>
#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "core/random.h"
#include "sim/renderer.h"
#include "sim/scene.h"
#include "sim/simd.h"
#include "sim/worker_pool.h"

namespace diorama {

// The response of the sensor's 8-bit output to linear light, 1 = full well. `filmic`: a shoulder
// and toe (the fit of ACES by K. Narkowicz), then the sRGB curve; `srgb`: that curve alone;
// `gamma`: a power of light; `linear`.
class ResponseCurve {
 public:
  explicit ResponseCurve(const EffectsOptions& effects = {});
  static constexpr int kLevels = 4096;
  // Looked up at round(sqrt(light) * kLevels), light in [0, 1].
  simd::Int8 operator[](simd::Int8 level) const { return simd::gather(table_.data(), level); }
  double evaluate(double light) const;  // in [0, 1], of white

 private:
  double unscaled(double light) const;
  std::string kind_;
  double gamma_;
  double white_ = 1;
  std::vector<int> table_;
};

class Sensor {
 public:
  Sensor(const Camera& camera, const EffectsOptions& effects, uint64_t seed);

  // `gain` turns radiance into parts of the full well, red, green and blue: one for all rows, or
  // one for each. Noise depends on the seed, the frame and the pixel only.
  Image<Rgb8> expose(const Image<Radiance>& radiance, const std::vector<Vector3d>& gain, int frame,
                     WorkerPool& pool) const;

 private:
  simd::Float8 withNoise(simd::Float8 light, simd::Int8 quantile) const;
  std::vector<simd::Int8> drawQuantiles(int frame, int y, size_t count) const;
  void exposeEight(const float* light, const float* vignette, const simd::Float8* gain,
                   const simd::Int8* quantiles, uint8_t* pixels) const;
  void exposeRow(const Image<Radiance>& radiance, const Vector3d& gain, int frame, int y,
                 Image<Rgb8>& out) const;

  EffectsOptions effects_;
  Random random_;
  ResponseCurve response_;
  int width_;
  std::vector<float> vignette_;            // share of the light that is left, per pixel
  std::vector<float> normal_;              // quantiles of the standard normal distribution
  float photon_variance_, read_variance_;  // of light: for each unit of it, and without any
};

}  // namespace diorama
