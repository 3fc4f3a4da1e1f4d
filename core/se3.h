// Rigid motions. Tangent vectors are xi = [rho, phi] (translation first); perturbations act on the
// right: T * exp(xi). Formulas: T. Barfoot, State Estimation for Robotics, ch. 7.
#pragma once

#include <Eigen/Geometry>

#include "core/types.h"

namespace diorama {

// The skew-symmetric matrix with skew(a) * b = a x b.
Matrix3d skew(const Vector3d& a);

// Rotation vector (rad) to unit quaternion and back; log returns an angle in [0, pi].
Eigen::Quaterniond expSO3(const Vector3d& phi);
Vector3d logSO3(const Eigen::Quaterniond& q);

// Left Jacobian of SO(3) and its inverse; the right ones are those of -phi.
Matrix3d leftJacobianSO3(const Vector3d& phi);
Matrix3d leftJacobianInverseSO3(const Vector3d& phi);

// T_a_b maps coordinates in b to coordinates in a: p_a = T_a_b * p_b.
struct SE3 {
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();  // unit
  Vector3d translation = Vector3d::Zero();                       // m

  static SE3 fromMatrix(const Eigen::Matrix4d& matrix);  // the rotation part is orthonormalised

  Matrix3d rotationMatrix() const { return rotation.toRotationMatrix(); }
  Eigen::Matrix4d matrix() const;
  SE3 inverse() const;
  bool isFinite() const;
};

// To the last digit.
inline bool operator==(const SE3& a, const SE3& b) {
  return a.translation == b.translation && a.rotation.coeffs() == b.rotation.coeffs();
}

SE3 operator*(const SE3& a, const SE3& b);
Vector3d operator*(const SE3& T, const Vector3d& p);

SE3 exp(const Vector6d& xi);
Vector6d log(const SE3& T);

// T * exp(xi) = exp(adjoint(T) * xi) * T.
Matrix6d adjoint(const SE3& T);

// exp(xi + d) ~ exp(xi) * exp(rightJacobian(xi) * d).
Matrix6d rightJacobian(const Vector6d& xi);
Matrix6d rightJacobianInverse(const Vector6d& xi);

// Angle of the rotation between two orientations, rad, in [0, pi].
double angleBetween(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b);

}  // namespace diorama
