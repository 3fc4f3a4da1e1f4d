// What is reported of the camera's motion: steps whose product is the newest pose in the map,
// though the map is corrected between them.
#pragma once

#include <optional>
#include <string>

#include "core/measurements.h"
#include "vo/map.h"
#include "vo/motion_model.h"
#include "vo/vague_scale.h"
#include "vo/vo_options.h"

namespace diorama::vo {

class MotionReport {
 public:
  MotionReport(std::string source_name, const VoOptions& options)
      : source_(std::move(source_name)), options_(options) {}

  // In a new map.
  void begin(int64_t timestamp_ns, const SE3& T_world_camera);
  // From the last frame with a pose; `hessian` is that of the pose, `scale_sigma` the relative one
  // of all lengths, nothing when they mean nothing yet; those of what the frame sees may be vague
  // beside. Of full health.
  OdometryMeasurement step(const TrackedFrame& last, const TrackedFrame& now,
                           const Matrix6d& hessian, std::optional<double> scale_sigma);
  // The camera is taken to go on as it did. Of no health.
  OdometryMeasurement coast(int64_t timestamp_ns, const MotionModel& motion);
  // The map was, and with it the pose that was reported last.
  void correct(const SE3& T_world_camera);
  // Lengths are others from here on.
  void stretch() { vague_scale_.begin(); }

  // Of the newest frame; when lost, where it is taken to be.
  const SE3& pose() const { return T_world_now_; }

 private:
  const std::string source_;
  const VoOptions& options_;
  SE3 T_world_now_;
  SE3 T_world_reported_;                    // as it was, before the map was corrected
  Vector6d correction_ = Vector6d::Zero();  // of the reported pose since, right tangent
  VagueScale vague_scale_;                  // of all lengths
  VagueScale vague_ground_;                 // of those of ground that is new
  int64_t previous_ns_ = 0;
};

}  // namespace diorama::vo
