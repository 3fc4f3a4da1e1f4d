// Follows one known object from frame to frame.
#pragma once

#include <optional>

#include "core/frame.h"
#include "core/measurements.h"

namespace diorama {

class ObjectTracker {
 public:
  virtual ~ObjectTracker() = default;

  // Measures the object in the next frame. Without `start` the tracker goes on from its own last
  // pose; with it, it forgets its motion and starts from the given pose *in this frame* (first
  // frame, feedback). Before the first start the measurement is not claimed.
  virtual ObjectMeasurement track(const Frame& frame,
                                  const std::optional<ObjectPrediction>& start) = 0;
};

}  // namespace diorama
