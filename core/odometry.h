// Measures the camera's motion from frame to frame.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/frame.h"
#include "core/measurements.h"

namespace diorama {

struct OdometryEvent {
  std::string event;  // started, lost, relocalised, reset
  double value = 0;
  std::string reason;
};

// A frame is track(), then leaveOut() and update() with what was seen of objects in it.
class Odometry {
 public:
  virtual ~Odometry() = default;

  // The motion to this frame from the previous one; after a loss, from the last frame whose motion
  // was measured (from_ns tells). Health 0 when the motion could not be measured, and nothing for
  // frames before the odometry has started.
  virtual std::optional<OdometryMeasurement> track(const Frame& frame) = 0;

  // Whether known objects in the frame just tracked are needed: it does not know its scale yet.
  virtual bool wantsObjects() const { return false; }

  // Objects that are known to move in the world, where they are in the frame just tracked: what is
  // seen of them says nothing of the camera. None of them is told to update().
  virtual void leaveOut(std::span<const ObjectMeasurement> /*moving*/) {}

  // Learns from the frame just tracked (mapping). Objects are optional.
  virtual void update(std::span<const ObjectMeasurement> /*objects*/) {}

  // Whether the frame just tracked has a pose, to which later motions lead.
  virtual bool started() const { return true; }

  // T_camera_object in the frame just tracked, of an object that it has placed by itself.
  virtual std::optional<SE3> locate(const std::string& /*object*/) const { return std::nullopt; }

  // What happened in this frame, with reasons.
  virtual std::vector<OdometryEvent> events() const { return {}; }
};

}  // namespace diorama
