#include "vo/start.h"

#include <algorithm>

#include "vo/object_scale.h"
#include "vo/surface_start.h"

namespace diorama::vo {

void Start::follow(const TrackedFrame& frame) {
  if (initialisation_.begun() && frame.pyramid) initialisation_.follow(frame);
}

StartAttempt Start::attempt(const TrackedFrame& frame, std::span<const ObjectMeasurement> objects,
                            Map& map) {
  const bool object_seen = std::any_of(objects.begin(), objects.end(), isUsable);
  if (!initialisation_.begun() || (object_seen && !initialisation_.sawObject())) {
    initialisation_.begin(frame, objects);
    return {};
  }
  const bool without_scale = ++frames_ >= options_.start_wait_frames;
  StartAttempt attempt = initialisation_.tryStart(frame, objects, without_scale, map);
  if (!attempt.started) {
    std::string reason = initialisation_.hopeless();
    if (reason.empty()) return {};
    attempt = startFromSurfaces(camera_, initialisation_, frame, objects, surfaces_, options_, map);
    if (!attempt.started) {
      if (!attempt.reason.empty()) reason += "; " + attempt.reason;
      initialisation_.askForLess();
      initialisation_.begin(frame, objects);
      return {.reason = reason};
    }
  }
  initialisation_.clear();
  trial_.begin();
  return successful_ = attempt;
}

Verdict Start::judge(const Map& map, const SE3& T_world_camera,
                     std::span<const ObjectMeasurement> objects, bool asked) {
  if (!asked || trial_.over()) return Verdict::kConfirmed;
  trial_.add(discrepancy(map, T_world_camera, objects, options_));
  if (trial_.refuted()) {
    initialisation_.askForMore();
    return Verdict::kRefuted;
  }
  return trial_.over() ? Verdict::kConfirmed : Verdict::kOpen;
}

}  // namespace diorama::vo
