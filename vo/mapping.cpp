#include "vo/mapping.h"

#include <algorithm>
#include <cmath>

#include "vo/bundle_adjustment.h"
#include "vo/keyframe_policy.h"

namespace diorama::vo {

void Mapping::begin(bool metric) {
  Keyframe& keyframe = *map_.keyframes.back();
  if (metric)
    scale_.begin(keyframe.timestamp_ns);
  else
    scale_.beginWithout();
  depth_filter_.addSeeds(camera_, keyframe, depthRange(keyframe), map_);
}

// What stands before the map may move with the camera. If it stays, it is the world that has
// changed, or its light; and in fast motion blur hides as much.
bool Mapping::isCovered(const TrackedFrame& frame) {
  if (!frame.hidden.any() || frame.isFast()) {
    covered_since_ns_.reset();
    return false;
  }
  if (!covered_since_ns_) covered_since_ns_ = frame.timestamp_ns;
  return 1e-9 * static_cast<double>(frame.timestamp_ns - *covered_since_ns_) <=
         options_.covered_time_s;
}

MapUpdate Mapping::update(TrackedFrame& frame, double acceleration,
                          std::span<const ObjectMeasurement> objects) {
  if (!isCovered(frame)) {
    frame.covered = false;
    frame.hidden = {};
  }
  depth_filter_.update(camera_, frame);
  if (!needsKeyframe(map_, frame, options_)) return {};
  makeRoom(frame);
  return addKeyframe(frame, acceleration, objects);
}

// What covers the map has corners, too, and as long as they have no depth they agree with any
// camera. Only where known points are seen is it the world that they belong to.
void Mapping::leaveOutUnsettled(TrackedFrame& frame) const {
  // Without adjustment nothing would find their depth but the filter.
  const bool all = options_.bundle_window == 0;
  std::erase_if(frame.features, [&](const Feature& f) {
    return !f.point->settled && (all || (frame.covered && !frame.hidden.isSeen(f.u_px)));
  });
}

void Mapping::leaveOutMoving(TrackedFrame& frame) {
  for (const Feature& f : frame.features)
    if (frame.moving.contains(f.u_px, f.level)) f.point->bad = true;
  const SE3 T_camera_world = frame.T_world_camera.inverse();
  for (const auto& point : map_.points)
    if (frame.moving.carry(T_camera_world * point->p_world)) point->bad = true;
  std::erase_if(frame.features, [](const Feature& f) { return f.point->bad; });
}

// A fast turn makes a keyframe of every frame: a window of a few would forget where it came from.
int Mapping::recentKeyframes() const {
  const int64_t since =
      map_.keyframes.back()->timestamp_ns - std::llround(1e9 * options_.bundle_time_s);
  return static_cast<int>(
      std::count_if(map_.keyframes.begin(), map_.keyframes.end(),
                    [&](const auto& keyframe) { return keyframe->timestamp_ns >= since; }));
}

void Mapping::makeRoom(TrackedFrame& frame) {
  if (static_cast<int>(map_.keyframes.size()) < options_.max_keyframes) return;
  Keyframe* gone = farthestKeyframe(map_, frame, options_.bundle_window);
  if (!gone) return;
  depth_filter_.removeHost(*gone);
  map_.removeKeyframe(*gone);
  forgetBadPoints(frame);
}

MapUpdate Mapping::addKeyframe(TrackedFrame& frame, double acceleration,
                               std::span<const ObjectMeasurement> objects) {
  MapUpdate update;
  update.adjusted = true;
  leaveOutUnsettled(frame);
  Keyframe& keyframe = map_.addKeyframe(frame);
  if (wantsObjects(frame.timestamp_ns)) attachObjects(map_, keyframe, objects, options_);
  if (!scale_.begun() && (update.stretched = learnScale(frame)) != 1)
    update.stretched_by = map_.objects.front().name;
  // While objects tell the scale, every keyframe since the start moves with it.
  const int window = scale_.begun() && wantsObjects(frame.timestamp_ns)
                         ? static_cast<int>(map_.keyframes.size())
                         : std::max(options_.bundle_window, recentKeyframes());
  if (options_.bundle_window > 0)
    adjustBundle(camera_, map_, {window, options_.bundle_iterations, scale_.begun(), acceleration},
                 options_);
  depth_filter_.forgetSettledPoints();
  depth_filter_.placePoints();
  scale_.assess(map_);
  frame.T_world_camera = keyframe.T_world_camera;
  forgetBadPoints(frame);
  depth_filter_.addSeeds(camera_, keyframe, depthRange(keyframe), map_);
  return update;
}

// Objects that came into view after a start without scale. The newest pose stays where it is, so
// that the path goes on from there. The factor, 1 when it is not known yet.
double Mapping::learnScale(const TrackedFrame& frame) {
  const std::optional<double> factor = scaleFromObjects(map_);
  if (!factor) return 1;
  map_.stretch(frame.T_world_camera.translation, *factor);
  depth_filter_.stretch(*factor);
  for (size_t i = 0; i < map_.objects.size(); ++i) placeObject(map_, i);
  scale_.begin(frame.timestamp_ns);
  return *factor;
}

void Mapping::forgetBadPoints(TrackedFrame& frame) {
  std::erase_if(frame.features, [](const Feature& f) { return f.point->bad; });
  depth_filter_.forgetBadPoints();
  map_.removeBadPoints();
}

}  // namespace diorama::vo
