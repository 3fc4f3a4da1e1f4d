// A tracker that was recorded: measurements.csv of a run, or of somebody else's system.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "core/object_tracker.h"

namespace diorama {

class ReplayTracker : public ObjectTracker {
 public:
  // Takes the measurements of `object`; others are ignored. `source` names the tracker.
  ReplayTracker(const std::vector<ObjectMeasurement>& measurements, std::string object,
                std::string source);

  // What was measured at the frame's time, or half a millisecond from it; not claimed where there
  // is nothing. Starts are ignored.
  ObjectMeasurement track(const Frame& frame,
                          const std::optional<ObjectPrediction>& start) override;

  // The first one.
  std::optional<SE3> firstPose() const;

 private:
  std::map<int64_t, ObjectMeasurement> measurements_;
  std::string object_, source_;
};

}  // namespace diorama
