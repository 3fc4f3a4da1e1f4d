#include "sim/sample_pattern.h"

#include <algorithm>
#include <cmath>

#include "core/errors.h"

namespace diorama {
namespace {

// Permutations k -> (k + 1) * factor mod (count + 1) - 1: in 4 x 4 the rotated grid, beyond it a
// lattice.
struct Factors {
  int row, moment;
};
Factors factors(int count) {
  switch (count) {
    case 4:
      return {2, 3};
    case 8:
      return {2, 4};
    case 16:
      return {7, 11};
    case 32:
      return {7, 13};
  }
  DIORAMA_CHECK(!"a sample count of 4, 8, 16 or 32");
}

double stratum(int k, int factor, int count) {  // in [-0.5, 0.5]
  return (((k + 1) * factor % (count + 1)) - 0.5) / count - 0.5;
}

// Samples k and count - 1 - k lie opposite to each other. Were one of them blurred more, edges
// would move.
float mirroredDither(int k, int count) {
  const int pair = std::min(k, count - 1 - k), pairs = count / 2;
  return (static_cast<float>(pair * 3 % pairs) + 0.5f) / static_cast<float>(pairs);
}

PixelSample makeSample(double du, double dv, float dither, const SE3& T_world_camera) {
  const Eigen::Matrix3f R = T_world_camera.rotationMatrix().cast<float>();
  return {static_cast<float>(du),
          static_cast<float>(dv),
          T_world_camera.translation.cast<float>(),
          R.col(0),
          R.col(1),
          R.col(2),
          dither};
}

SamplePattern makeSamplePattern(int count, bool extra, const ExposureMotion& motion,
                                double row_offset_s) {
  const Factors f = factors(count);
  SamplePattern pattern;
  for (int k = 0; k < count; ++k) {
    const double du = (k + 0.5) / count - 0.5, dv = stratum(k, f.row, count);
    const double offset_s = motion.exposure_s * stratum(k, f.moment, count);
    const float dither = mirroredDither(k, count);
    pattern.base.push_back(
        makeSample(du, dv, dither, motion.T_world_camera(row_offset_s + offset_s)));
    if (extra)
      pattern.extra.push_back(
          makeSample(-du, dv, dither, motion.T_world_camera(row_offset_s - offset_s)));
  }
  pattern.footprint = count == 4 ? 0.6f : count == 8 ? 0.5f : 0.4f;
  return pattern;
}

}  // namespace

MovingPattern::MovingPattern(int count, bool extra, const ExposureMotion& motion, int height,
                             WorkerPool& pool)
    : by_row_(motion.row_time_s == 0 ? 1 : static_cast<size_t>(height)) {
  pool.run(static_cast<int>(by_row_.size()), [&](int y) {
    const double offset_s = by_row_.size() == 1 ? 0 : motion.rowOffset_s(y, height);
    by_row_[static_cast<size_t>(y)] = makeSamplePattern(count, extra, motion, offset_s);
  });
}

}  // namespace diorama
