#include "core/se3.h"

#include <cmath>

namespace diorama {
namespace {

// Below this angle the closed forms lose digits to cancellation and three terms of the series are
// exact.
constexpr double kSmallAngle = 0.03;

// Coefficients of the closed forms as functions of theta = |phi|.
struct Coefficients {
  double a;  // (1 - cos) / theta^2
  double b;  // (theta - sin) / theta^3
  double c;  // (theta^2 + 2 cos - 2) / (2 theta^4)
  double d;  // (2 theta - 3 sin + theta cos) / (2 theta^5)
};

Coefficients coefficients(double theta) {
  const double t2 = theta * theta;
  if (theta < kSmallAngle) {
    const double t4 = t2 * t2;
    return {1.0 / 2 - t2 / 24 + t4 / 720, 1.0 / 6 - t2 / 120 + t4 / 5040,
            1.0 / 24 - t2 / 720 + t4 / 40320, 1.0 / 120 - t2 / 2520 + t4 / 120960};
  }
  const double s = std::sin(theta), c = std::cos(theta);
  const double half = std::sin(theta / 2);
  return {2 * half * half / t2, (theta - s) / (t2 * theta), (t2 + 2 * c - 2) / (2 * t2 * t2),
          (2 * theta - 3 * s + theta * c) / (2 * t2 * t2 * theta)};
}

// The off-diagonal block Q(rho, phi) of the left Jacobian of SE(3), Barfoot (7.86).
Matrix3d jacobianBlock(const Vector3d& rho, const Vector3d& phi) {
  const Matrix3d R = skew(rho), P = skew(phi);
  const Matrix3d PR = P * R, RP = R * P, PRP = PR * P;
  const Coefficients k = coefficients(phi.norm());
  return 0.5 * R + k.b * (PR + RP + PRP) + k.c * (P * PR + RP * P - 3 * PRP) +
         k.d * (PRP * P + P * PRP);
}

Matrix6d leftJacobian(const Vector6d& xi) {
  const Matrix3d J = leftJacobianSO3(xi.tail<3>());
  Matrix6d out;
  out << J, jacobianBlock(xi.head<3>(), xi.tail<3>()), Matrix3d::Zero(), J;
  return out;
}

Matrix6d leftJacobianInverse(const Vector6d& xi) {
  const Matrix3d J = leftJacobianInverseSO3(xi.tail<3>());
  Matrix6d out;
  out << J, -J * jacobianBlock(xi.head<3>(), xi.tail<3>()) * J, Matrix3d::Zero(), J;
  return out;
}

}  // namespace

Matrix3d skew(const Vector3d& a) {
  Matrix3d m;
  m << 0, -a.z(), a.y(), a.z(), 0, -a.x(), -a.y(), a.x(), 0;
  return m;
}

Eigen::Quaterniond expSO3(const Vector3d& phi) {
  const double half = phi.norm() / 2;
  const double h2 = half * half;
  // sin(half) / (2 half)
  const double k = half < 1e-3 ? 0.5 * (1 - h2 / 6 + h2 * h2 / 120) : std::sin(half) / (2 * half);
  return {std::cos(half), k * phi.x(), k * phi.y(), k * phi.z()};
}

Vector3d logSO3(const Eigen::Quaterniond& q) {
  const double sign = q.w() < 0 ? -1 : 1;
  const double n = q.vec().norm(), w = sign * q.w();
  if (n < 1e-9) return sign * 2 / w * q.vec();
  return sign * 2 * std::atan2(n, w) / n * q.vec();
}

Matrix3d leftJacobianSO3(const Vector3d& phi) {
  const Coefficients k = coefficients(phi.norm());
  const Matrix3d P = skew(phi);
  return Matrix3d::Identity() + k.a * P + k.b * P * P;
}

Matrix3d leftJacobianInverseSO3(const Vector3d& phi) {
  const double theta = phi.norm(), t2 = theta * theta;
  const double k = theta < kSmallAngle ? 1.0 / 12 + t2 / 720 + t2 * t2 / 30240
                                       : (1 - theta / 2 / std::tan(theta / 2)) / t2;
  const Matrix3d P = skew(phi);
  return Matrix3d::Identity() - 0.5 * P + k * P * P;
}

SE3 SE3::fromMatrix(const Eigen::Matrix4d& matrix) {
  return {Eigen::Quaterniond(matrix.topLeftCorner<3, 3>()).normalized(),
          matrix.topRightCorner<3, 1>()};
}

Eigen::Matrix4d SE3::matrix() const {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = rotationMatrix();
  m.topRightCorner<3, 1>() = translation;
  return m;
}

SE3 SE3::inverse() const {
  const Eigen::Quaterniond q = rotation.conjugate();
  return {q, -(q * translation)};
}

bool SE3::isFinite() const { return rotation.coeffs().allFinite() && translation.allFinite(); }

SE3 operator*(const SE3& a, const SE3& b) {
  return {(a.rotation * b.rotation).normalized(), a.rotation * b.translation + a.translation};
}

Vector3d operator*(const SE3& T, const Vector3d& p) { return T.rotation * p + T.translation; }

SE3 exp(const Vector6d& xi) {
  const Vector3d phi = xi.tail<3>();
  return {expSO3(phi), leftJacobianSO3(phi) * xi.head<3>()};
}

Vector6d log(const SE3& T) {
  const Vector3d phi = logSO3(T.rotation);
  Vector6d xi;
  xi << leftJacobianInverseSO3(phi) * T.translation, phi;
  return xi;
}

Matrix6d adjoint(const SE3& T) {
  const Matrix3d R = T.rotationMatrix();
  Matrix6d out;
  out << R, skew(T.translation) * R, Matrix3d::Zero(), R;
  return out;
}

Matrix6d rightJacobian(const Vector6d& xi) { return leftJacobian(-xi); }
Matrix6d rightJacobianInverse(const Vector6d& xi) { return leftJacobianInverse(-xi); }

double angleBetween(const Eigen::Quaterniond& a, const Eigen::Quaterniond& b) {
  return logSO3(a.conjugate() * b).norm();
}

}  // namespace diorama
