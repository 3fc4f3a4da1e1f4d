#include "tracker/motion_filter.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace diorama {
namespace {

// Of a camera in a hand, to begin with: standard deviations of its velocity when nothing is known,
// and of its acceleration from frame to frame.
constexpr double kSpeed_m_s = 0.5, kSpeed_rad_s = 1;
constexpr double kAcceleration_m_s2 = 5, kAcceleration_rad_s2 = 10;

// The noise is taken for white, but accelerations of a hand last for some five frames: what they
// add up to has five times the standard deviation.
constexpr double kCaution = 25;
constexpr double kLeastJerkiness = 1e-3, kMostJerkiness = 1e3;
constexpr double kRate = 0.05;  // of learning it, per frame

template <int N>
using Matrix = Eigen::Matrix<double, N, N>;

// Of a symmetric positive definite matrix.
template <int N>
Matrix<N> inverse(const Matrix<N>& m) {
  const Matrix<N> found = m.llt().solve(Matrix<N>::Identity());
  return 0.5 * (found + found.transpose());
}

// Covariance of motions of the camera, as motions of the model in its own frame.
Matrix6d ofCamera(const SE3& T_camera_model, double sigma_m, double sigma_rad) {
  Vector6d variance;
  variance << Vector3d::Constant(sigma_m * sigma_m), Vector3d::Constant(sigma_rad * sigma_rad);
  const Matrix6d A = adjoint(T_camera_model.inverse());
  return A * variance.asDiagonal() * A.transpose();
}

}  // namespace

// Both of a Student distribution with six degrees of freedom.
double PosePrior::weightOf(const SE3& T_found) const {
  const Vector6d e = log(T_camera_model.inverse() * T_found);
  return std::min(1.0, 12 / (6 + e.dot(information * e)));
}

double PosePrior::logDensity(const SE3& T_found) const {
  const Vector6d e = log(T_camera_model.inverse() * T_found);
  return -6 * std::log1p(e.dot(information * e) / 6);
}

CueEquations PriorCue::linearise(const SE3& T) {
  const Vector6d e = log(prior_.T_camera_model.inverse() * T);
  const Matrix6d J = rightJacobianInverse(e);
  CueEquations equations;
  const Matrix6d weighted = prior_.weightOf(T) * J.transpose() * prior_.information;
  equations.hessian = weighted * J;
  equations.gradient = weighted * e;
  return equations;
}

void MotionFilter::start(const SE3& T, const Matrix6d& covariance) {
  started_ = true;
  state_ = {T};
  state_.covariance.topLeftCorner<6, 6>() = covariance;
  state_.covariance.bottomRightCorner<6, 6>() = ofCamera(T, kSpeed_m_s, kSpeed_rad_s);
}

MotionFilter::State MotionFilter::propagated(double seconds) const {
  State next = state_;
  const SE3 motion = exp(seconds * state_.velocity);
  next.T_camera_model = state_.T_camera_model * motion;
  Matrix12d F = Matrix12d::Identity();
  F.topLeftCorner<6, 6>() = adjoint(motion.inverse());
  F.topRightCorner<6, 6>() = seconds * Matrix6d::Identity();
  Eigen::Matrix<double, 12, 6> G;
  G << 0.5 * seconds * seconds * Matrix6d::Identity(), seconds * Matrix6d::Identity();
  const Matrix6d acceleration =
      kCaution * jerkiness_ *
      ofCamera(next.T_camera_model, kAcceleration_m_s2, kAcceleration_rad_s2);
  next.covariance = F * state_.covariance * F.transpose() + G * acceleration * G.transpose();
  return next;
}

PosePrior MotionFilter::predict(double seconds) const {
  const State next = propagated(seconds);
  return {next.T_camera_model, inverse<6>(next.covariance.topLeftCorner<6, 6>())};
}

void MotionFilter::jump(double seconds, const SE3& T, const Matrix6d& covariance) {
  const State expected = propagated(seconds);
  // The same motion of the camera, seen from the model where it is now.
  const Matrix6d A = adjoint(T.inverse() * expected.T_camera_model);
  state_ = {T, A * expected.velocity};
  state_.covariance.topLeftCorner<6, 6>() = covariance;
  state_.covariance.bottomRightCorner<6, 6>() =
      A * expected.covariance.bottomRightCorner<6, 6>() * A.transpose();
}

void MotionFilter::correct(double seconds, const SE3& T, const Matrix6d& information) {
  const State expected = propagated(seconds);
  const Matrix6d before = expected.covariance.topLeftCorner<6, 6>();
  const PosePrior prior{expected.T_camera_model, inverse<6>(before)};
  const Vector6d corrected = log(expected.T_camera_model.inverse() * T);
  Matrix12d sum = prior.weightOf(T) * inverse<12>(expected.covariance);
  sum.topLeftCorner<6, 6>() += information;
  state_.covariance = inverse<12>(sum);
  state_.velocity = expected.velocity +
                    expected.covariance.bottomLeftCorner<6, 6>() * (prior.information * corrected);
  state_.T_camera_model = T;
  started_ = state_.covariance.allFinite() && state_.velocity.allFinite();
  if (started_) learnJerks(corrected, before, state_.covariance.topLeftCorner<6, 6>());
}

// A correction by the gain k of what the image says has the variance k^2 (P + R) = k P, were the
// prediction's covariance P right, of which k (1 - k) P is the image's noise.
void MotionFilter::learnJerks(const Vector6d& corrected, const Matrix6d& before,
                              const Matrix6d& after) {
  const Eigen::LLT<Matrix6d> root(before);
  const Matrix6d half = root.matrixL().solve(after);
  const Matrix6d kept = root.matrixL().solve(half.transpose());
  const Eigen::SelfAdjointEigenSolver<Matrix6d> directions(kept);
  const Vector6d along = directions.eigenvectors().transpose() * root.matrixL().solve(corrected);
  double explained = 0, possible = 0;
  for (int i = 0; i < 6; ++i) {
    const double gain = std::clamp(1 - directions.eigenvalues()[i], 0.0, 1.0);
    explained += along[i] * along[i] - gain * (1 - gain);
    possible += gain * gain;
  }
  constexpr double kMostAtOnce = 5, kHardlyAny = 0.25;
  if (!(possible >= kHardlyAny)) return;
  const double ratio = std::clamp(kCaution * explained / possible, 0.0, kMostAtOnce);
  jerkiness_ = std::clamp(jerkiness_ * (1 + kRate * (ratio - 1)), kLeastJerkiness, kMostJerkiness);
}

}  // namespace diorama
