// The odometry, frame by frame, and where it alone says that the camera is.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/frame.h"
#include "core/odometry.h"
#include "core/trajectory.h"

namespace diorama {

// What it says of a frame's motion.
struct CameraStep {
  int64_t timestamp_ns = 0;
  std::optional<OdometryMeasurement> measurement;
  SE3 guess;           // what is taken for the motion since the frame before without a measurement
  SE3 T_world_camera;  // by odometry alone; of the frame, once `started`
  bool started = false;    // before it learnt from the frame
  bool explained = false;  // it says itself, with its events, why nothing was measured
  bool wants_objects = false;
  double ms = 0;
};

// What it knows after it has learnt from the frame.
struct CameraUpdate {
  int64_t timestamp_ns = 0;
  SE3 T_world_camera;
  bool started = false;
  std::vector<OdometryEvent> events;
  std::vector<std::optional<SE3>> T_camera_object;  // of objects that it has placed by itself
  double ms = 0;
};

// What the trackers measured in a frame.
struct SeenObjects {
  std::vector<ObjectMeasurement> at_rest, moving;  // in the world, as far as the map knows
};

class CameraStage {
 public:
  CameraStage(std::unique_ptr<Odometry> odometry, std::vector<std::string> objects);

  // Each frame: track(), then update() with what was seen in it of objects.
  CameraStep track(const Frame& frame);
  CameraUpdate update(const SeenObjects& seen);

 private:
  SE3 poseAt(int64_t timestamp_ns) const;
  SE3 guessedStep(const std::optional<OdometryMeasurement>& measurement) const;

  std::unique_ptr<Odometry> odometry_;
  std::vector<std::string> objects_;
  int64_t now_ns_ = 0;
  SE3 T_world_camera_;
  // From the last frame whose motion was measured on: what a motion can begin at.
  std::vector<StampedPose> since_measured_;
};

}  // namespace diorama
