#include "sim/motion_path.h"

#include <cmath>

#include "core/errors.h"

namespace diorama {
namespace {

class OrbitPath : public MotionPath {
 public:
  explicit OrbitPath(const Orbit& orbit) : orbit_(orbit) {}

  SE3 pose(double time_s) const override {
    const double azimuth = orbit_.start_rad + orbit_.rate_rad_s * time_s;
    const Vector3d offset(orbit_.radius_m * std::cos(azimuth), orbit_.radius_m * std::sin(azimuth),
                          orbit_.height_m);
    return lookAt(orbit_.center + offset, orbit_.center);
  }

 private:
  Orbit orbit_;
};

}  // namespace

SE3 lookAt(const Vector3d& position, const Vector3d& target, double roll_rad) {
  const Vector3d forward = target - position;
  DIORAMA_CHECK(forward.norm() > 0);
  Matrix3d axes;  // columns: the camera's x (right), y (down), z (forward) in the world
  axes.col(2) = forward.normalized();
  Vector3d right = axes.col(2).cross(Vector3d::UnitZ());
  // Within a microradian of the vertical there is no azimuth: the world's x is to the right when
  // looking down, to the left when looking up, so that +y is up in the image.
  if (right.norm() < 1e-6) right = Vector3d::UnitX() * -axes(2, 2);
  axes.col(0) = right.normalized();
  axes.col(1) = axes.col(2).cross(axes.col(0));
  const Eigen::Quaterniond rotation(axes);
  return {(rotation * expSO3({0, 0, roll_rad})).normalized(), position};
}

std::unique_ptr<MotionPath> makeOrbitPath(const Orbit& orbit) {
  return std::make_unique<OrbitPath>(orbit);
}

std::unique_ptr<MotionPath> makeRecordedPath(const Trajectory& recording,
                                             const Placement& placement) {
  DIORAMA_CHECK(!recording.poses.empty());
  std::vector<Keyframe> keyframes;
  const int64_t start_ns = recording.poses.front().timestamp_ns;
  for (const StampedPose& stamped : recording.poses) {
    const SE3 scaled{stamped.pose.rotation, placement.scale * stamped.pose.translation};
    const double time_s = static_cast<double>(stamped.timestamp_ns - start_ns) * 1e-9;
    keyframes.push_back({time_s * placement.time_scale, placement.T_world_recorded * scaled});
  }
  return makeSplinePath(keyframes);
}

}  // namespace diorama
