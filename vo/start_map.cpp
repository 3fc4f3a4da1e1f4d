#include "vo/start_map.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "vo/bundle_adjustment.h"
#include "vo/epipolar_search.h"
#include "vo/object_scale.h"
#include "vo/reprojection.h"
#include "vo/start_trial.h"

namespace diorama::vo {
namespace {

constexpr double kRayGapPx = 4;  // between two rays that meet in a point; poses are not exact yet
constexpr size_t kMostBetween = 4;    // frames, in the map
constexpr size_t kSeveralFrames = 4;  // keyframes that see a point
constexpr double kCloselyPx = 0.5;    // at the corner's level, rms
constexpr double kFewestAgreeThroughout = 0.3;

struct StartPoint {
  const FollowedCorner* corner;
  MapPoint* point;
};

// Px at the levels where it was seen.
double reprojectionRms(const Camera& camera, const MapPoint& point) {
  double sum = 0;
  for (const Observation& o : point.observations) {
    const auto u = camera.project(o.keyframe->T_world_camera.inverse() * point.p_world);
    if (!u) return std::numeric_limits<double>::infinity();
    sum += std::pow(o.errorPx(o.u_px - *u), 2);
  }
  return std::sqrt(sum / static_cast<double>(point.observations.size()));
}

}  // namespace

std::vector<SE3> motionsOfObjects(std::span<const ObjectMeasurement> then_seen,
                                  std::span<const ObjectMeasurement> now_seen) {
  std::vector<SE3> motions;
  for (const ObjectMeasurement& now : now_seen)
    for (const ObjectMeasurement& then : then_seen)
      if (now.object == then.object && isUsable(now) && isUsable(then))
        motions.push_back(then.T_camera_object * now.T_camera_object.inverse());
  return motions;
}

std::optional<Vector3d> meetingPoint(const Camera& camera, const FollowedCorner& corner,
                                     const SE3& T_second_first) {
  const auto bearing = camera.unproject(corner.u_px);
  const auto point =
      bearing ? triangulate(T_second_first, corner.bearing_first, *bearing) : std::nullopt;
  const double focal = 0.5 * (camera.fx() + camera.fy());
  if (!point || point->error * focal > kRayGapPx) return std::nullopt;
  return corner.bearing_first / point->inverse_depth;
}

namespace {

std::vector<StartPoint> addPoints(const Camera& camera, const FollowedCorners& followed,
                                  const SE3& T_first_second, const VoOptions& options,
                                  Keyframe& first, Map& map) {
  const SE3 T_second_first = T_first_second.inverse();
  std::vector<StartPoint> added;
  for (const FollowedCorner& c : followed.corners)
    if (const auto p_first = meetingPoint(camera, c, T_second_first))
      added.push_back(
          {&c, &map.addPoint(first, *p_first, hostMeasurement(c.u_first_px, c.level, options))});
  return added;
}

// Of those that objects tell, that under which most points are seen where their corners were.
std::optional<SE3> poseBetween(const Camera& camera, const FollowedCorners& followed, size_t k,
                               std::span<const StartPoint> points) {
  std::optional<SE3> best;
  std::ptrdiff_t most = -1;
  for (const SE3& T_first_k : motionsOfObjects(followed.objects, followed.between[k].objects)) {
    const SE3 T_k_first = T_first_k.inverse();
    const auto agree = std::count_if(points.begin(), points.end(), [&](const StartPoint& p) {
      const auto u = camera.project(T_k_first * p.point->p_world);
      return u && (*u - p.corner->between[k].u_px).norm() < kRayGapPx;
    });
    if (agree <= most) continue;
    most = agree;
    best = T_first_k;
  }
  return best;
}

}  // namespace

void fillMap(const Camera& camera, const FollowedCorners& followed, const TrackedFrame& frame,
             std::span<const ObjectMeasurement> objects, const SE3& T_first_second,
             bool with_between, const VoOptions& options, Map& map) {
  Keyframe& first = map.addKeyframe(followed.first);
  attachObjects(map, first, followed.objects, options);
  const std::vector<StartPoint> points =
      addPoints(camera, followed, T_first_second, options, first, map);
  const auto add = [&](TrackedFrame keyframe, const SE3& T_world_camera, const auto& measured,
                       std::span<const ObjectMeasurement> seen) {
    keyframe.T_world_camera = T_world_camera;
    keyframe.features.clear();
    for (const StartPoint& p : points) keyframe.features.push_back({measured(*p.corner), p.point});
    attachObjects(map, map.addKeyframe(keyframe), seen, options);
  };
  const size_t count = with_between ? std::min(followed.between.size(), kMostBetween) : 0;
  for (size_t i = 0; i < count; ++i) {
    const size_t k = i * followed.between.size() / count;
    const auto measured = [k](const FollowedCorner& c) { return c.between[k]; };
    if (const auto T_first_k = poseBetween(camera, followed, k, points))
      add(followed.between[k].frame, *T_first_k, measured, followed.between[k].objects);
  }
  add(
      frame, T_first_second, [](const FollowedCorner& c) { return c.measured; }, objects);
}

// Twice, for then they are measured again by patches warped with the better poses.
void adjustMap(const Camera& camera, bool metric, const VoOptions& options, Map& map) {
  constexpr int kIterations = 20;
  const int window = static_cast<int>(map.keyframes.size());
  adjustBundle(camera, map, {window, kIterations, metric}, options);
  map.removeBadPoints();
  for (const auto& point : map.points) point->observations.resize(1);
  for (size_t i = 1; i < map.keyframes.size(); ++i) {
    Keyframe& keyframe = *map.keyframes[i];
    measureAll(camera, map, keyframe, options);
    for (const Feature& feature : keyframe.features)
      feature.point->observations.push_back({feature, &keyframe});
  }
  adjustBundle(camera, map, {window, kIterations, metric}, options);
  map.removeBadPoints();
}

bool objectsAgree(const Map& map) {
  return std::all_of(map.keyframes.begin(), map.keyframes.end(), [&](const auto& keyframe) {
    const auto d = discrepancy(map, *keyframe);
    return !d || !contradicts(*d);
  });
}

bool enoughAgreeThroughout(const Camera& camera, const FollowedCorners& followed,
                           const ObjectSurfaces& surfaces, int fewest, const Map& map) {
  if (map.keyframes.size() < kSeveralFrames || !surfaces.know(followed.objects)) return false;
  const auto isOff = [&](const Vector2d& u_px, int level) {
    return !surfaces.touch(camera, u_px, level, followed.objects);
  };
  const auto agree = std::count_if(map.points.begin(), map.points.end(), [&](const auto& point) {
    const Observation& first = point->observations.front();
    return point->observations.size() >= kSeveralFrames && isOff(first.u_px, first.level) &&
           reprojectionRms(camera, *point) < kCloselyPx;
  });
  const auto off =
      std::count_if(followed.corners.begin(), followed.corners.end(),
                    [&](const FollowedCorner& c) { return isOff(c.u_first_px, c.level); });
  return agree >= fewest &&
         static_cast<double>(agree) >= kFewestAgreeThroughout * static_cast<double>(off);
}

}  // namespace diorama::vo
