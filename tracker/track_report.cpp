#include "tracker/track_report.h"

namespace diorama {

ObjectMeasurement TrackReport::of(const Frame& frame, const Estimate& estimate, bool good) const {
  const bool certain = isCertain(estimate.covariance, options_);
  ObjectMeasurement m = notClaimed(frame, estimate.T_camera_model,
                                   !good      ? "too few edges agree with the pose"
                                   : !certain ? "the pose is too uncertain"
                                              : "");
  // exp(xi) moves through T_object_model by its adjoint.
  const Matrix6d move = adjoint(T_object_model_);
  m.covariance = move * estimate.covariance * move.transpose();
  m.health = estimate.health.value;
  m.claimed = good && certain;
  return m;
}

ObjectMeasurement TrackReport::notClaimed(const Frame& frame, const SE3& T_camera_model,
                                          const std::string& reason) const {
  ObjectMeasurement m;
  m.source = source_;
  m.object = object_;
  m.timestamp_ns = frame.timestamp_ns;
  m.T_camera_object = T_camera_model * T_object_model_.inverse();
  m.reason = reason;
  return m;
}

}  // namespace diorama
