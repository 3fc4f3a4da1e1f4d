#include "vo/surface_start.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "vo/corners.h"
#include "vo/object_scale.h"
#include "vo/reprojection.h"

namespace diorama::vo {
namespace {

constexpr int kCorners = 300;
constexpr size_t kFewestPoints = 12;  // hold a camera's pose with a margin
constexpr double kNearestM = 0.2;     // most of what is seen is farther
constexpr double kOffRayPx = 4;       // poses of objects are not exact

// Whether it is where a point somewhere on its first ray would be seen.
bool isOnRay(const Camera& camera, const FollowedCorner& corner, const SE3& T_now_first) {
  const Vector3d far = T_now_first.rotation * corner.bearing_first;
  const auto end = camera.project(far);
  const auto begin = camera.project(far + T_now_first.translation / kNearestM);
  if (!begin || !end) return false;
  const Vector2d along = *end - *begin, from = corner.u_px - *begin;
  const double square = along.squaredNorm();
  const double part = square > 0 ? std::clamp(from.dot(along) / square, 0.0, 1.0) : 0;
  return (from - part * along).norm() < kOffRayPx;
}

// Of the nearest one, m.
double distanceOf(std::span<const ObjectMeasurement> objects) {
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const ObjectMeasurement& object : objects)
    if (isUsable(object))
      nearest_m = std::min(nearest_m, object.T_camera_object.translation.norm());
  return nearest_m;
}

// Without any motion in the image nothing tells whether the objects rest in the world; and when
// they say that the camera moved far, the corners would have shown parallax: points at infinity,
// which never do, are on any ray.
bool movesAsObjectsSay(const Camera& camera, const Initialisation& initialisation,
                       std::span<const ObjectMeasurement> objects, const VoOptions& options) {
  const std::vector<FollowedCorner>& corners = initialisation.followed().corners;
  if (corners.size() < kFewestPoints ||
      initialisation.motionInImage() < kSmallestMotion * options.start_disparity_px)
    return false;
  const double farthest_m = options.start_baseline_rad * distanceOf(objects);
  for (const SE3& T_first_now : motionsOfObjects(initialisation.followed().objects, objects)) {
    if (T_first_now.translation.norm() > farthest_m) continue;
    const auto agree = std::count_if(corners.begin(), corners.end(), [&](const auto& corner) {
      return isOnRay(camera, corner, T_first_now.inverse());
    });
    if (static_cast<double>(agree) >= kFewestAgree * static_cast<double>(corners.size()))
      return true;
  }
  return false;
}

struct Known {
  Corner corner;
  Vector3d bearing;
  InverseDepth depth;
};

std::vector<Known> cornersOnObjects(const Camera& camera, const TrackedFrame& frame,
                                    std::span<const ObjectMeasurement> objects,
                                    const ObjectSurfaces& surfaces, const VoOptions& options) {
  const CellGrid grid(camera.width(), camera.height(), options.cell_px);
  const std::vector<uint8_t> occupied(grid.size(), 0);
  std::vector<Known> known;
  for (const Corner& corner :
       detectCorners(*frame.pyramid, frame.noise, grid, occupied, kCorners, options)) {
    const auto bearing = camera.unproject(corner.u_px);
    const auto depth = surfaces.depthAt(camera, corner.u_px, corner.level, objects, options);
    if (bearing && depth) known.push_back({corner, *bearing, *depth});
  }
  return known;
}

// The error of an object's pose is in all of its points: each of n has n times its variance, so
// that they are not surer together than the object is.
void addPoint(const Known& known, double n, const VoOptions& options, Keyframe& keyframe,
              Map& map) {
  const Corner& corner = known.corner;
  MapPoint& point = map.addPoint(keyframe, known.bearing / known.depth.value,
                                 hostMeasurement(corner.u_px, corner.level, options));
  const double sigma_m = known.depth.sigma / (known.depth.value * known.depth.value);
  const Matrix3d along = known.bearing * known.bearing.transpose();
  point.covariance = sigma_m * sigma_m * along;
  point.assumed_p_world = point.p_world;
  point.assumed_information =
      along / (n * sigma_m * sigma_m * std::pow(known.bearing.squaredNorm(), 2));
}

}  // namespace

StartAttempt startFromSurfaces(const Camera& camera, const Initialisation& initialisation,
                               const TrackedFrame& frame,
                               std::span<const ObjectMeasurement> objects,
                               const ObjectSurfaces& surfaces, const VoOptions& options, Map& map) {
  StartAttempt attempt;
  if (!movesAsObjectsSay(camera, initialisation, objects, options)) return attempt;
  const std::vector<Known> known = cornersOnObjects(camera, frame, objects, surfaces, options);
  if (known.size() < kFewestPoints) {
    attempt.reason = "too few corners on known objects to start from";
    return attempt;
  }
  TrackedFrame first = frame;
  first.T_world_camera = SE3{};
  first.features.clear();
  Keyframe& keyframe = map.addKeyframe(first);
  for (const Known& one : known)
    addPoint(one, static_cast<double>(known.size()), options, keyframe, map);
  attachObjects(map, keyframe, objects, options);
  keyframe.tracked = keyframe.features.size();
  attempt.started = attempt.metric = true;
  attempt.points = static_cast<int>(known.size());
  attempt.reason = "from the surface of";
  for (const MapObject& object : map.objects) attempt.reason += " " + object.name;
  return attempt;
}

}  // namespace diorama::vo
