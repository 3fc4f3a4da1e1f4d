#include "vo/object_surfaces.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "vo/object_scale.h"
#include "vo/patch.h"

namespace diorama::vo {
namespace {

constexpr double kLeastCosine = 0.2;  // between ray and normal: nearer to edge-on depth is vague
constexpr double kStep = 0.1;  // of the depth, within a patch: there is an outline in between

std::array<Vector2d, 4> cornersOfPatch(const Vector2d& u_px, int level) {
  const double reach = 0.5 * Patch::kBordered / levelScale(level);
  return {u_px + Vector2d(-reach, -reach), u_px + Vector2d(reach, -reach),
          u_px + Vector2d(-reach, reach), u_px + Vector2d(reach, reach)};
}

}  // namespace

std::optional<ObjectSurfaces::Hit> ObjectSurfaces::meet(
    const Camera& camera, const Vector2d& u_px, std::span<const ObjectMeasurement> objects) const {
  const auto bearing = camera.unproject(u_px);
  std::optional<Hit> nearest;
  if (!rays_ || !bearing || !camera.contains(u_px, 0)) return nearest;
  for (const ObjectMeasurement& object : objects) {
    const auto name = std::find(names_.begin(), names_.end(), object.object);
    if (name == names_.end() || !isUsable(object)) continue;
    const SE3 T_object_camera = object.T_camera_object.inverse();
    const auto hit =
        rays_->closestHit(static_cast<int>(name - names_.begin()), T_object_camera.translation,
                          T_object_camera.rotation * *bearing);
    if (!hit) continue;
    const double depth_m = (object.T_camera_object * hit->p_object).z();
    if (depth_m > 0 && (!nearest || depth_m < nearest->depth_m))
      nearest = Hit{&object, *hit, depth_m};
  }
  return nearest;
}

bool ObjectSurfaces::know(std::span<const ObjectMeasurement> objects) const {
  return rays_ && std::all_of(objects.begin(), objects.end(), [&](const ObjectMeasurement& o) {
           return !isUsable(o) || std::find(names_.begin(), names_.end(), o.object) != names_.end();
         });
}

bool ObjectSurfaces::touch(const Camera& camera, const Vector2d& u_px, int level,
                           std::span<const ObjectMeasurement> objects) const {
  const auto corners = cornersOfPatch(u_px, level);
  return meet(camera, u_px, objects) ||
         std::any_of(corners.begin(), corners.end(), [&](const Vector2d& corner) {
           return meet(camera, corner, objects).has_value();
         });
}

std::optional<double> ObjectSurfaces::distanceTo(const Camera& camera, const Vector2d& u_px,
                                                 std::span<const ObjectMeasurement> objects) const {
  const auto hit = meet(camera, u_px, objects);
  return hit ? std::optional(hit->depth_m) : std::nullopt;
}

std::optional<InverseDepth> ObjectSurfaces::depthAt(const Camera& camera, const Vector2d& u_px,
                                                    int level,
                                                    std::span<const ObjectMeasurement> objects,
                                                    const VoOptions& options) const {
  const auto hit = meet(camera, u_px, objects);
  if (!hit) return std::nullopt;
  for (const Vector2d& corner : cornersOfPatch(u_px, level)) {
    const auto beside = meet(camera, corner, objects);
    if (!beside || beside->object != hit->object ||
        std::abs(beside->depth_m - hit->depth_m) > kStep * hit->depth_m)
      return std::nullopt;
  }
  // The object's pose errs by xi: its surface moves by n . R (rho + phi x p) along its normal, and
  // the depth by that over n . b.
  const Matrix3d R = hit->object->T_camera_object.rotationMatrix();
  const Vector3d n = R * hit->at.normal,
                 b = (R * hit->at.p_object + hit->object->T_camera_object.translation) /
                     hit->depth_m;
  const double slope = n.dot(b);
  if (!(std::abs(slope) > kLeastCosine * b.norm())) return std::nullopt;
  Vector6d J;
  J << hit->at.normal, hit->at.p_object.cross(hit->at.normal);
  const double sigma_m =
      std::sqrt(J.dot(covarianceOf(*hit->object, options) * J)) / std::abs(slope);
  return InverseDepth{1 / hit->depth_m, sigma_m / (hit->depth_m * hit->depth_m)};
}

}  // namespace diorama::vo
