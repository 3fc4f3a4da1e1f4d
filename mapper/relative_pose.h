// The residual of a measured pose of one frame in another, which odometry and object factors share.
#pragma once

#include <array>
#include <memory>
#include <optional>

#include "core/se3.h"
#include "mapper/robust_kernel.h"

namespace ceres {
class CostFunction;
}

namespace diorama {

// W of a whitened residual W r, W^T W = covariance^-1. What counts is its length, so that W is kept
// as an upper triangle, in single precision: a long graph has several of them per pose.
class Whitening {
 public:
  Whitening() : Whitening(Matrix6d::Identity()) {}
  explicit Whitening(const Matrix6d& W);  // any root, triangular or not

  Matrix6d matrix() const;

 private:
  std::array<float, 21> rows_;
};

// A residual with its derivatives by right perturbations of both poses.
struct LinearisedPair {
  Vector6d r;
  Matrix6d J_a, J_b;
};

// r = Log(Z^-1 * T_world_a^-1 * T_world_b), Z = measured T_a_b:
//   dr/db = Jr^-1(r), dr/da = -Jr^-1(r) * Ad(T_b_a).
LinearisedPair linearise(const SE3& Z, const SE3& T_world_a, const SE3& T_world_b);

// Whitened, and multiplied with the square root of the kernel's weight rho'(|W r|^2), so that a
// least-squares step on it is a step of iteratively reweighted least squares.
LinearisedPair whitened(const LinearisedPair& pair, const Matrix6d& W, const RobustKernel& kernel);

double rootWeight(const Vector6d& r, const Matrix6d& W, const RobustKernel& kernel);

// Finite, of sane size, and with a unit quaternion.
bool isUnitPose(const SE3& pose);

// Nothing when the covariance is not finite, not symmetric, not positive definite, or beyond 1e12.
// Standard deviations below 1e-6 (m, rad) count as 1e-6: no sensor is better, and the graph's
// arithmetic is not either.
std::optional<Whitening> whitening(const Matrix6d& covariance);

// The factor W * r between two SE(3) blocks.
std::unique_ptr<ceres::CostFunction> makeRelativePoseCost(const SE3& Z, const Matrix6d& W);

}  // namespace diorama
