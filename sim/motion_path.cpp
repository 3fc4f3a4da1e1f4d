#include "sim/motion_path.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/errors.h"

namespace diorama {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;

double sumOf(const Swings& swings, double time_s) {
  double sum = 0;
  for (const Swing& swing : swings)
    sum += swing.amplitude * std::sin(kTwoPi * time_s / swing.period_s);
  return sum;
}

class AimedPath : public MotionPath {
 public:
  AimedPath(PointOverTime position, Aim aim)
      : position_(std::move(position)), aim_(std::move(aim)) {}

  SE3 pose(double time_s) const override {
    const Vector3d p = position_(time_s);
    return {aim_(time_s, p), p};
  }

 private:
  PointOverTime position_;
  Aim aim_;
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

double minimumJerk(double fraction) {
  const double x = std::clamp(fraction, 0.0, 1.0);
  return x * x * x * (10 + x * (-15 + 6 * x));
}

std::unique_ptr<MotionPath> makeAimedPath(PointOverTime position, Aim aim) {
  return std::make_unique<AimedPath>(std::move(position), std::move(aim));
}

Aim aimFixed(const Eigen::Quaterniond& rotation) {
  return [rotation](double, const Vector3d&) { return rotation; };
}

Aim aimAt(PointOverTime target, double roll_rad) {
  return [target = std::move(target), roll_rad](double time_s, const Vector3d& position) {
    const Vector3d point = target(time_s);
    const bool too_near = (point - position).norm() < 1e-6;
    return lookAt(position, too_near ? position + Vector3d::UnitX() : point, roll_rad).rotation;
  };
}

PointOverTime onOrbit(const Orbit& orbit) {
  return [orbit](double time_s) -> Vector3d {
    const double azimuth =
        orbit.start_rad + orbit.rate_rad_s * time_s + sumOf(orbit.azimuth_swing, time_s);
    const double radius = orbit.radius_m + sumOf(orbit.radius_swing, time_s);
    const double height = orbit.height_m + sumOf(orbit.height_swing, time_s);
    return orbit.center + Vector3d(radius * std::cos(azimuth), radius * std::sin(azimuth), height);
  };
}

PointOverTime onDolly(const Vector3d& from, const Vector3d& to, double start_s, double end_s) {
  DIORAMA_CHECK(end_s > start_s);
  return [=](double time_s) -> Vector3d {
    return from + minimumJerk((time_s - start_s) / (end_s - start_s)) * (to - from);
  };
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
