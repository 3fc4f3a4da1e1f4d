#include "vo/keyframe_policy.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace diorama::vo {
namespace {

// Keyframes that look elsewhere do not overlap: half a usual field of view.
constexpr double kOverlapCosine = 0.85;  // 32 degrees
// When features get few, the camera must still have moved for them to have parallax.
constexpr double kLeastDistance = 0.03;  // of the median depth
// ... or turned to what no keyframe shows, where new corners hold the rotation at least.
constexpr double kTurnedCosine = 0.9925;  // 7 degrees, an eighth of a usual field of view

}  // namespace

bool needsKeyframe(const Map& map, const TrackedFrame& frame, const VoOptions& options) {
  const double depth = depthRange(frame).median_m;
  const double far = options.keyframe_distance_m > 0 ? options.keyframe_distance_m
                                                     : options.keyframe_distance * depth;
  const Vector3d axis = frame.T_world_camera.rotation * Vector3d::UnitZ();
  double nearest = std::numeric_limits<double>::infinity();
  bool turned = true;
  for (const auto& keyframe : map.keyframes) {
    const double cosine = axis.dot(keyframe->T_world_camera.rotation * Vector3d::UnitZ());
    const double distance =
        (keyframe->T_world_camera.translation - frame.T_world_camera.translation).norm();
    if (cosine > kOverlapCosine) nearest = std::min(nearest, distance);
    if (cosine > kTurnedCosine && distance < far) turned = false;
  }
  if (nearest > far) return true;
  const Keyframe& last = *map.keyframes.back();
  const double moved = (last.T_world_camera.translation - frame.T_world_camera.translation).norm();
  const double few = std::max(options.keyframe_min_share * static_cast<double>(last.tracked),
                              double(options.unsettled_below));
  return static_cast<double>(certainFeatures(frame)) <= few &&
         (turned || moved > kLeastDistance * depth);
}

Keyframe* farthestKeyframe(const Map& map, const TrackedFrame& frame, int window) {
  Keyframe* farthest = nullptr;
  double distance = -1;
  const size_t n = map.keyframes.size();
  for (size_t i = 0; i + static_cast<size_t>(window) < n; ++i) {
    const double d =
        (map.keyframes[i]->T_world_camera.translation - frame.T_world_camera.translation).norm();
    if (d > distance) {
      distance = d;
      farthest = map.keyframes[i].get();
    }
  }
  return farthest;
}

}  // namespace diorama::vo
