#include "sim/sample_pattern.h"

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
    case 4: return {2, 3};
    case 8: return {2, 4};
    case 16: return {7, 11};
    case 32: return {7, 13};
  }
  DIORAMA_CHECK(!"a sample count of 4, 8, 16 or 32");
}

double stratum(int k, int factor, int count) {  // in [-0.5, 0.5]
  return (((k + 1) * factor % (count + 1)) - 0.5) / count - 0.5;
}

PixelSample makeSample(double du, double dv, const SE3& T_world_camera) {
  const Eigen::Matrix3f R = T_world_camera.rotationMatrix().cast<float>();
  return {static_cast<float>(du), static_cast<float>(dv), T_world_camera.translation.cast<float>(),
          R.col(0),               R.col(1),               R.col(2)};
}

}  // namespace

SamplePattern makeSamplePattern(int count, const ExposureMotion& motion) {
  const Factors f = factors(count);
  SamplePattern pattern;
  for (int k = 0; k < count; ++k) {
    const double du = (k + 0.5) / count - 0.5, dv = stratum(k, f.row, count);
    const double moment = motion.blur ? stratum(k, f.moment, count) : 0;
    pattern.base.push_back(makeSample(du, dv, motion.pose(moment)));
    if (count != 8) pattern.extra.push_back(makeSample(-du, dv, motion.pose(-moment)));
  }
  pattern.footprint = count == 4 ? 0.6f : count == 8 ? 0.5f : 0.4f;
  return pattern;
}

}  // namespace diorama
