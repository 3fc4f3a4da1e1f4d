#include "tracker/view_sphere.h"

#include <cmath>
#include <numbers>

namespace diorama {

std::vector<Vector3d> sphereDirections(int count) {
  std::vector<Vector3d> directions;
  for (int k = 0; k < count; ++k) {
    const double z = (2 * k + 1.0) / count - 1, radius = std::sqrt(1 - z * z);
    const double azimuth = k * std::numbers::pi * (3 - std::sqrt(5.0));
    directions.emplace_back(radius * std::cos(azimuth), radius * std::sin(azimuth), z);
  }
  return directions;
}

SE3 viewFrom(const Vector3d& direction, double distance, const Vector3d& centre_object) {
  const Vector3d forward = -direction.normalized();
  const Vector3d up = std::abs(forward.z()) > 0.999 ? Vector3d::UnitY() : Vector3d::UnitZ();
  const Vector3d right = forward.cross(up).normalized();
  Matrix3d R_object_camera;
  R_object_camera << right, forward.cross(right), forward;
  const SE3 T_object_camera{Eigen::Quaterniond(R_object_camera),
                            centre_object - distance * forward};
  return T_object_camera.inverse();
}

}  // namespace diorama
