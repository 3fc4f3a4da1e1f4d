#include "vo/motion_report.h"

#include <cmath>

#include "vo/tracking_quality.h"

namespace diorama::vo {

void MotionReport::begin(int64_t timestamp_ns, const SE3& T_world_camera) {
  T_world_now_ = T_world_reported_ = T_world_camera;
  correction_.setZero();
  vague_scale_.begin();
  previous_ns_ = timestamp_ns;
}

OdometryMeasurement MotionReport::step(const TrackedFrame& last, const TrackedFrame& now,
                                       const Matrix6d& hessian, std::optional<double> scale_sigma) {
  OdometryMeasurement m{source_, last.timestamp_ns, now.timestamp_ns,
                        T_world_reported_.inverse() * now.T_world_camera};
  m.covariance = stepCovariance(last, now, hessian, options_);
  const Vector6d correction =
      adjoint(now.T_world_camera.inverse() * last.T_world_camera) * correction_;
  m.covariance += correction * correction.transpose();
  m.up_to_scale = !scale_sigma;
  if (scale_sigma) m.covariance += vague_scale_.add(m.T_from_to, *scale_sigma);
  const double ground_sigma = std::sqrt(now.scale_variance);
  if (ground_sigma < options_.scale_sigma) vague_ground_.begin();  // it is known well enough
  m.covariance += vague_ground_.add(m.T_from_to, ground_sigma);
  m.health = 1;
  correction_.setZero();
  T_world_reported_ = T_world_now_ = now.T_world_camera;
  previous_ns_ = now.timestamp_ns;
  return m;
}

OdometryMeasurement MotionReport::coast(int64_t timestamp_ns, const MotionModel& motion) {
  OdometryMeasurement m{source_, previous_ns_, timestamp_ns,
                        motion.coast(previous_ns_, timestamp_ns)};
  previous_ns_ = timestamp_ns;
  T_world_now_ = T_world_now_ * m.T_from_to;
  return m;
}

void MotionReport::correct(const SE3& T_world_camera) {
  T_world_now_ = T_world_camera;
  correction_ = log(T_world_reported_.inverse() * T_world_camera);
}

}  // namespace diorama::vo
