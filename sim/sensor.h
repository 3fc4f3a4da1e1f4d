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

// The response of the sensor's 8-bit output to linear light, 1 = full well: a filmic shoulder and
// toe (the fit of ACES by K. Narkowicz), then the sRGB curve.
class ResponseCurve {
 public:
  ResponseCurve();
  static constexpr int kLevels = 4096;
  // Looked up at round(sqrt(light) * kLevels), light in [0, 1].
  uint8_t operator[](int level) const { return table_[static_cast<size_t>(level)]; }
  static double evaluate(double light);  // in [0, 1]

 private:
  std::vector<uint8_t> table_;
};

class Sensor {
 public:
  // `exposure` turns radiance into parts of the full well.
  Sensor(const Camera& camera, const EffectsOptions& effects, double exposure, uint64_t seed);

  // Noise depends on the seed, the frame and the pixel only.
  Image<Rgb8> expose(const Image<Radiance>& radiance, int frame, WorkerPool& pool) const;

 private:
  simd::Float8 withNoise(simd::Float8 light, int frame, uint64_t draw) const;
  void exposeRow(const Image<Radiance>& radiance, int frame, int y, Image<Rgb8>& out) const;

  EffectsOptions effects_;
  Random random_;
  ResponseCurve response_;
  int width_;
  std::vector<float> gain_;    // exposure and vignette, per pixel
  std::vector<float> normal_;  // quantiles of the standard normal distribution
};

// The exposure at which the radiance that 80% of the pixels stay below becomes a bright grey.
double chooseExposure(const std::vector<Image<Radiance>>& pictures);

}  // namespace diorama
