// What tests share: nearness of poses and of matrices, numeric Jacobians, random poses.
#pragma once

#include <gmock/gmock.h>

#include <cmath>
#include <functional>

#include "core/random.h"
#include "core/se3.h"

namespace diorama::test {

// Both within a tolerance: translation in m, rotation in rad.
MATCHER_P3(PoseNear, expected, translation_m, rotation_rad, "") {
  const double translation = (arg.translation - expected.translation).norm();
  const double rotation = angleBetween(arg.rotation, expected.rotation);
  *result_listener << "which is off by " << translation << " m and " << rotation << " rad";
  return translation <= translation_m && rotation <= rotation_rad;
}

// Every entry within an absolute tolerance; works on vectors and matrices of the same size.
MATCHER_P2(MatrixNear, expected, tolerance, "") {
  if (arg.rows() != expected.rows() || arg.cols() != expected.cols()) {
    *result_listener << "whose size is " << arg.rows() << " x " << arg.cols();
    return false;
  }
  const double off = (arg - expected).cwiseAbs().maxCoeff();
  *result_listener << "which is off by " << off;
  return off <= tolerance;
}

// Derivative of f, a function of a vector, by central differences.
template <class F, class Vector>
Eigen::MatrixXd numericJacobian(const F& f, const Vector& at, double step = 1e-6) {
  const Eigen::VectorXd value = f(at);
  Eigen::MatrixXd J(value.size(), at.size());
  for (Eigen::Index i = 0; i < at.size(); ++i) {
    Vector plus = at, minus = at;
    plus[i] += step;
    minus[i] -= step;
    const Eigen::VectorXd up = f(plus), down = f(minus);
    J.col(i) = (up - down) / (2 * step);
  }
  return J;
}

// Derivative of f(T * Exp(xi)) by xi at 0, by central differences.
template <class F>
Eigen::MatrixXd numericPoseJacobian(const F& f, const SE3& T, double step = 1e-6) {
  return numericJacobian([&](const Vector6d& xi) { return Eigen::VectorXd(f(T * exp(xi))); },
                         Vector6d(Vector6d::Zero()), step);
}

// Numbers that are the same in every run; each call gives the next ones.
class Numbers {
 public:
  explicit Numbers(uint64_t seed) : random_(seed, RandomStream::kTest) {}

  double uniform(double low, double high) {
    return low + (high - low) * random_.uniform(0, n_++)[0];
  }
  double normal() { return random_.normal(0, n_++)[0]; }
  Vector3d vector3(double size) {
    return {uniform(-size, size), uniform(-size, size), uniform(-size, size)};
  }
  Vector6d normal6() {
    Vector6d v;
    for (int i = 0; i < 6; ++i) v[i] = normal();
    return v;
  }
  // Translation within a cube, a rotation of any angle up to max_angle about any axis.
  SE3 pose(double size, double max_angle = 3.1) {
    Vector3d axis = vector3(1);
    if (axis.norm() < 1e-3) axis = Vector3d::UnitX();
    return {expSO3(axis.normalized() * uniform(0, max_angle)), vector3(size)};
  }

 private:
  Random random_;
  uint64_t n_ = 0;
};

}  // namespace diorama::test
