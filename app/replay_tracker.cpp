#include "app/replay_tracker.h"

#include "app/recorded_time.h"

namespace diorama {

ReplayTracker::ReplayTracker(const std::vector<ObjectMeasurement>& measurements, std::string object,
                             std::string source)
    : object_(std::move(object)), source_(std::move(source)) {
  for (const ObjectMeasurement& m : measurements)
    if (m.object == object_)
      measurements_.emplace(m.timestamp_ns, m).first->second.source = source_;
}

ObjectMeasurement ReplayTracker::track(const Frame& frame, const std::optional<ObjectPrediction>&) {
  const auto found = measurements_.lower_bound(frame.timestamp_ns - kSameTime_ns);
  if (found != measurements_.end() && isSameTime(found->first, frame.timestamp_ns)) {
    ObjectMeasurement measurement = found->second;
    measurement.timestamp_ns = frame.timestamp_ns;
    return measurement;
  }
  ObjectMeasurement none;
  none.source = source_;
  none.object = object_;
  none.timestamp_ns = frame.timestamp_ns;
  none.reason = "nothing was recorded for this frame";
  return none;
}

std::optional<SE3> ReplayTracker::firstPose() const {
  if (measurements_.empty()) return std::nullopt;
  return measurements_.begin()->second.T_camera_object;
}

}  // namespace diorama
