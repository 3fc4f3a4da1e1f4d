// The camera at a constant velocity: where it is at times that nobody has measured.
#pragma once

#include <cstdint>
#include <optional>

#include "core/measurements.h"
#include "core/se3.h"

namespace diorama {

class CameraMotion {
 public:
  // T_world_camera of frames in the order of time.
  void add(int64_t timestamp_ns, const SE3& T_world_camera) {
    if (known_ && timestamp_ns > timestamp_ns_)
      velocity_ = log(T_world_camera_.inverse() * T_world_camera) / seconds(timestamp_ns);
    known_ = true;
    timestamp_ns_ = timestamp_ns;
    T_world_camera_ = T_world_camera;
  }

  bool known() const { return known_; }
  SE3 at(int64_t timestamp_ns) const {
    return T_world_camera_ * exp(velocity_ * seconds(timestamp_ns));
  }
  // T_camera_object at another time.
  ObjectPrediction carry(ObjectPrediction prediction, int64_t from_ns, int64_t to_ns) const {
    if (from_ns == to_ns) return prediction;
    const double s = 1e-9 * static_cast<double>(to_ns - from_ns);
    prediction.T_camera_object = exp(velocity_ * -s) * prediction.T_camera_object;
    return prediction;
  }

 private:
  double seconds(int64_t timestamp_ns) const {
    return 1e-9 * static_cast<double>(timestamp_ns - timestamp_ns_);
  }

  bool known_ = false;
  int64_t timestamp_ns_ = 0;
  SE3 T_world_camera_;
  Vector6d velocity_ = Vector6d::Zero();  // in the camera's frame, 1/s
};

}  // namespace diorama
