// Measures the camera's motion from frame to frame.
#pragma once

#include <optional>

#include "core/frame.h"
#include "core/measurements.h"

namespace diorama {

class Odometry {
 public:
  virtual ~Odometry() = default;
  // The motion from the previous frame to this one; nothing for the first frame.
  virtual std::optional<OdometryMeasurement> track(const Frame& frame) = 0;
};

}  // namespace diorama
