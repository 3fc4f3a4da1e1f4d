// Several trackers of one object at once: a frame's measurement is that of the first one in the
// list that claims the object, so that another one carries on while the better one has lost it, and
// gives it a start. They are not averaged: they look at the same pictures, and share their errors.
#pragma once

#include <memory>
#include <vector>

#include "core/object_tracker.h"

namespace diorama {

class TrackerRelay : public ObjectTracker {
 public:
  // In the order of preference; at least one.
  explicit TrackerRelay(std::vector<std::unique_ptr<ObjectTracker>> trackers);

  // A start is for all. Who has lost the object starts where another one has found it. What nobody
  // claims is what the first one says.
  ObjectMeasurement track(const Frame& frame,
                          const std::optional<ObjectPrediction>& start) override;

 private:
  struct Runner {
    std::unique_ptr<ObjectTracker> tracker;
    bool holds = false;  // it claimed the object in the last frame
  };
  std::vector<Runner> runners_;
};

}  // namespace diorama
