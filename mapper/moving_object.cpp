#include "mapper/moving_object.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace diorama {
namespace {

// Of a velocity that nobody has measured: faster than anything on a table.
constexpr double kAnySpeed_m_s = 1, kAnySpeed_rad_s = 5;

Vector6d each(double m, double rad) {
  Vector6d values;
  values << Vector3d::Constant(m), Vector3d::Constant(rad);
  return values;
}

}  // namespace

MovingObject::MovingObject(const MotionOptions& options, int64_t timestamp_ns,
                           const SE3& T_world_object, const Matrix6d& covariance)
    : options_(options), timestamp_ns_(timestamp_ns), T_world_object_(T_world_object) {
  P_.setZero();
  P_.topLeftCorner<6, 6>() = covariance;
  P_.bottomRightCorner<6, 6>().diagonal() = each(kAnySpeed_m_s, kAnySpeed_rad_s).cwiseAbs2();
}

// With the integrals of white acceleration over dt: q [dt^3/3, dt^2/2; dt^2/2, dt].
void MovingObject::propagate(int64_t timestamp_ns) {
  const double dt = 1e-9 * static_cast<double>(timestamp_ns - timestamp_ns_);
  if (dt <= 0) return;
  timestamp_ns_ = timestamp_ns;
  // Of a velocity that dies away the way is v tau (1 - e^(-dt / tau)).
  const double left = std::exp(-dt / options_.coast_s);
  const double way_s = options_.coast_s * (1 - left);
  const SE3 step = exp(velocity_ * way_s);
  T_world_object_ = T_world_object_ * step;
  Matrix12d F = Matrix12d::Identity();
  F.topLeftCorner<6, 6>() = adjoint(step.inverse());
  F.topRightCorner<6, 6>() = rightJacobian(velocity_ * way_s) * way_s;
  F.bottomRightCorner<6, 6>() *= left;
  velocity_ *= left;
  const Vector6d q = each(options_.accel_m_s2, options_.accel_rad_s2).cwiseAbs2();
  P_ = (F * P_ * F.transpose()).eval();
  P_.topLeftCorner<6, 6>().diagonal() += q * (dt * dt * dt / 3);
  P_.topRightCorner<6, 6>().diagonal() += q * (dt * dt / 2);
  P_.bottomLeftCorner<6, 6>().diagonal() += q * (dt * dt / 2);
  P_.bottomRightCorner<6, 6>().diagonal() += q * dt;
}

double MovingObject::absorb(int64_t timestamp_ns, const SE3& T_world_object,
                            const Matrix6d& covariance, double limit) {
  propagate(timestamp_ns);
  const Vector6d e = log(T_world_object_.inverse() * T_world_object);
  const Eigen::LDLT<Matrix6d> S(P_.topLeftCorner<6, 6>() + covariance);
  const double innovation = e.dot(S.solve(e));
  if (!(innovation < limit)) return innovation;
  const Eigen::Matrix<double, 12, 6> K = S.solve(P_.topRows<6>()).transpose();
  const Eigen::Matrix<double, 12, 1> step = K * e;
  T_world_object_ = T_world_object_ * exp(step.head<6>());
  velocity_ += step.tail<6>();
  P_ -= (K * P_.topRows<6>()).eval();
  P_ = (0.5 * (P_ + P_.transpose())).eval();
  return innovation;
}

MovingObject::Place MovingObject::at(int64_t timestamp_ns) const {
  MovingObject then = *this;
  then.propagate(timestamp_ns);
  return {then.T_world_object_, then.P_.topLeftCorner<6, 6>()};
}

}  // namespace diorama
