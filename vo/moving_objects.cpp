#include "vo/moving_objects.h"

#include <cmath>

#include "vo/object_surfaces.h"

namespace diorama::vo {
namespace {

constexpr double kNear = 0.15;  // of the depth: points are not yet known well, and it has moved

}  // namespace

bool MovingObjects::contains(const Vector2d& u_px, int level) const {
  return !objects_.empty() && surfaces_->touch(*camera_, u_px, level, objects_);
}

bool MovingObjects::carry(const Vector3d& p_camera) const {
  const auto u_px = objects_.empty() ? std::nullopt : camera_->project(p_camera);
  const auto depth_m = u_px ? surfaces_->distanceTo(*camera_, *u_px, objects_) : std::nullopt;
  return depth_m && std::abs(p_camera.z() - *depth_m) < kNear * *depth_m;
}

}  // namespace diorama::vo
