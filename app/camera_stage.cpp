#include "app/camera_stage.h"

#include "app/stopwatch.h"

namespace diorama {

CameraStage::CameraStage(std::unique_ptr<Odometry> odometry, std::vector<std::string> objects)
    : odometry_(std::move(odometry)), objects_(std::move(objects)) {}

CameraStep CameraStage::track(const Frame& frame) {
  const Stopwatch watch;
  CameraStep step;
  step.timestamp_ns = now_ns_ = frame.timestamp_ns;
  step.measurement = odometry_->track(frame);
  step.guess = guessedStep(step.measurement);
  if (step.measurement) {
    T_world_camera_ = poseAt(step.measurement->from_ns) * step.measurement->T_from_to;
    if (step.measurement->health > 0) since_measured_.clear();
  }
  step.T_world_camera = T_world_camera_;
  step.started = odometry_->started();
  step.explained = !odometry_->events().empty();
  step.wants_objects = odometry_->wantsObjects();
  step.ms = watch.ms();
  return step;
}

// The newest pose when there is none at that time.
SE3 CameraStage::poseAt(int64_t timestamp_ns) const {
  for (const StampedPose& pose : since_measured_)
    if (pose.timestamp_ns == timestamp_ns) return pose.pose;
  return T_world_camera_;
}

SE3 CameraStage::guessedStep(const std::optional<OdometryMeasurement>& measurement) const {
  const bool from_last = measurement && !since_measured_.empty() &&
                         measurement->from_ns == since_measured_.back().timestamp_ns;
  return from_last ? measurement->T_from_to : SE3{};
}

CameraUpdate CameraStage::update(const SeenObjects& seen) {
  const Stopwatch watch;
  CameraUpdate update;
  odometry_->leaveOut(seen.moving);
  odometry_->update(seen.at_rest);
  update.timestamp_ns = now_ns_;
  update.T_world_camera = T_world_camera_;
  update.started = odometry_->started();
  update.events = odometry_->events();
  for (const std::string& object : objects_)
    update.T_camera_object.push_back(odometry_->locate(object));
  if (update.started) since_measured_.push_back({now_ns_, T_world_camera_});
  update.ms = watch.ms();
  return update;
}

}  // namespace diorama
