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

void setLanes(SamplePair& pair, int half, double du, double dv, const SE3& T_world_camera) {
  const Matrix3d R = T_world_camera.rotationMatrix();
  const Vector3d& o = T_world_camera.translation;
  for (int lane = 4 * half; lane < 4 * half + 4; ++lane) {
    pair.du[lane] = static_cast<float>(du);
    pair.dv[lane] = static_cast<float>(dv);
    const auto set = [lane](simd::Vector8& to, const Vector3d& v) {
      to.x[lane] = static_cast<float>(v.x());
      to.y[lane] = static_cast<float>(v.y());
      to.z[lane] = static_cast<float>(v.z());
    };
    set(pair.origin, o);
    set(pair.axis_x, R.col(0));
    set(pair.axis_y, R.col(1));
    set(pair.axis_z, R.col(2));
  }
}

}  // namespace

SamplePattern makeSamplePattern(int count, const ExposureMotion& motion) {
  const Factors f = factors(count);
  SamplePattern pattern;
  pattern.base.resize(static_cast<size_t>(count / 2));
  pattern.extra.resize(static_cast<size_t>(count / 2));
  for (int k = 0; k < count; ++k) {
    const double du = (k + 0.5) / count - 0.5, dv = stratum(k, f.row, count);
    const double moment = motion.blur ? stratum(k, f.moment, count) : 0;
    const SE3 pose = motion.pose(moment);
    setLanes(pattern.base[static_cast<size_t>(k / 2)], k % 2, du, dv, pose);
    setLanes(pattern.extra[static_cast<size_t>(k / 2)], k % 2, -du, dv,
             motion.blur ? motion.pose(-moment) : pose);
  }
  pattern.footprint = count == 4 ? 0.6f : count == 8 ? 0.5f : 0.4f;
  return pattern;
}

}  // namespace diorama
