// Identities of SO(3) and SE(3), to rounding.
#include "core/se3.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/matchers.h"

namespace diorama {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)

constexpr double kPi = std::numbers::pi;

// Tangents with rotation angles from nothing to nearly pi, on both sides of every switch of
// formula.
std::vector<Vector6d> tangents() {
  Numbers numbers(1);
  std::vector<Vector6d> all;
  for (double angle :
       {0.0,  1e-300, 1e-16,      1e-12,      1e-9,      1e-8,      1e-6,    1e-5,
        1e-4, 1e-3,   1.999e-3,   2.001e-3,   1e-2,      0.0299999, 0.03,    0.0300001,
        0.05, 0.0999, 0.1,        0.3,        1.0,       1.5,       kPi / 2, 2.0,
        3.0,  3.1,    kPi - 1e-3, kPi - 1e-6, kPi - 1e-9}) {
    for (int i = 0; i < 8; ++i) {
      Vector6d xi;
      xi << numbers.vector3(2), angle * numbers.vector3(1).normalized();
      all.push_back(xi);
    }
  }
  return all;
}

TEST(SE3, LogUndoesExp) {
  for (const Vector6d& xi : tangents())
    EXPECT_THAT(log(exp(xi)), MatrixNear(xi, 1e-12)) << xi.transpose();
}

TEST(SE3, ExpUndoesLogAlsoBeyondPi) {
  Numbers numbers(2);
  for (int i = 0; i < 500; ++i) {
    SE3 T = numbers.pose(3, kPi);
    if (i % 2) T.rotation.coeffs() *= -1;  // the same rotation
    EXPECT_THAT(exp(log(T)), PoseNear(T, 1e-12, 1e-12));
    EXPECT_LE(logSO3(T.rotation).norm(), kPi + 1e-15);
  }
}

TEST(SE3, LogOfExactlyPi) {
  for (const Vector3d& axis : {Vector3d::UnitX().eval(), Vector3d::UnitY().eval(),
                               Vector3d(1, -2, 3).normalized().eval()}) {
    const SE3 T{Eigen::Quaterniond(0, axis.x(), axis.y(), axis.z()), {1, 2, 3}};
    const Vector6d xi = log(T);
    EXPECT_NEAR(xi.tail<3>().norm(), kPi, 1e-12);
    EXPECT_THAT(exp(xi), PoseNear(T, 1e-12, 1e-12));
  }
}

TEST(SE3, ExpAgreesWithItsPowerSeries) {
  for (const Vector6d& xi : tangents()) {
    Eigen::Matrix4d generator = Eigen::Matrix4d::Zero();
    generator.topLeftCorner<3, 3>() = skew(xi.tail<3>());
    generator.topRightCorner<3, 1>() = xi.head<3>();
    Eigen::Matrix4d sum = Eigen::Matrix4d::Identity(), term = sum;
    for (int n = 1; n < 60; ++n) {
      term = term * generator / n;
      sum += term;
    }
    EXPECT_THAT(exp(xi).matrix(), MatrixNear(sum, 1e-12)) << xi.transpose();
  }
}

TEST(SE3, GroupOperations) {
  Numbers numbers(3);
  for (int i = 0; i < 100; ++i) {
    const SE3 a = numbers.pose(3), b = numbers.pose(3), c = numbers.pose(3);
    const Vector3d p = numbers.vector3(2);
    EXPECT_THAT(a * a.inverse(), PoseNear(SE3{}, 1e-14, 1e-14));
    EXPECT_THAT((a * b) * c, PoseNear(a * (b * c), 1e-13, 1e-13));
    EXPECT_THAT((a * b) * p, MatrixNear(a * (b * p), 1e-13));
    EXPECT_THAT(a * (a.inverse() * p), MatrixNear(p, 1e-13));
    EXPECT_THAT((a * b).matrix(), MatrixNear(a.matrix() * b.matrix(), 1e-13));
    EXPECT_THAT(SE3::fromMatrix(a.matrix()), PoseNear(a, 0, 1e-14));
  }
}

TEST(SE3, LongProductsStayUnit) {
  Numbers numbers(4);
  SE3 T;
  const SE3 step = numbers.pose(0.01);
  for (int i = 0; i < 100000; ++i) T = T * step;
  EXPECT_NEAR(T.rotation.norm(), 1, 1e-14);
}

TEST(SE3, AdjointMovesATangentAcross) {
  Numbers numbers(5);
  for (const Vector6d& xi : tangents()) {
    const SE3 T = numbers.pose(2);
    EXPECT_THAT(T * exp(xi), PoseNear(exp(Vector6d(adjoint(T) * xi)) * T, 1e-12, 1e-12));
  }
  const SE3 a = numbers.pose(2), b = numbers.pose(2);
  EXPECT_THAT(adjoint(a * b), MatrixNear(adjoint(a) * adjoint(b), 1e-12));
  EXPECT_THAT(adjoint(a.inverse()) * adjoint(a), MatrixNear(Matrix6d(Matrix6d::Identity()), 1e-12));
}

TEST(SE3, RightJacobianTimesItsInverseIsIdentity) {
  for (const Vector6d& xi : tangents())
    EXPECT_THAT(rightJacobian(xi) * rightJacobianInverse(xi),
                MatrixNear(Matrix6d(Matrix6d::Identity()), 1e-12))
        << xi.transpose();
}

// Jr(xi) = sum (-ad(xi))^n / (n + 1)!
TEST(SE3, RightJacobianAgreesWithItsPowerSeries) {
  for (const Vector6d& xi : tangents()) {
    const Matrix3d R = skew(xi.head<3>()), P = skew(xi.tail<3>());
    Matrix6d ad;
    ad << P, R, Matrix3d::Zero(), P;
    Matrix6d sum = Matrix6d::Identity(), term = sum;
    for (int n = 1; n < 60; ++n) {
      term = term * -ad / (n + 1);
      sum += term;
    }
    EXPECT_THAT(rightJacobian(xi), MatrixNear(sum, 1e-12)) << xi.transpose();
  }
}

TEST(SE3, JacobiansMatchNumericOnes) {
  for (const Vector6d& xi : tangents()) {
    if (xi.tail<3>().norm() > 3.1) continue;  // log jumps at pi
    const SE3 T = exp(xi);
    const Eigen::MatrixXd Jr = numericJacobian(
        [&](const Vector6d& x) { return Eigen::VectorXd(log(T.inverse() * exp(x))); }, xi);
    EXPECT_THAT(rightJacobian(xi), MatrixNear(Jr, 1e-8)) << xi.transpose();
    const Eigen::MatrixXd inverse = numericPoseJacobian([](const SE3& x) { return log(x); }, T);
    EXPECT_THAT(rightJacobianInverse(xi), MatrixNear(inverse, 1e-7)) << xi.transpose();
  }
}

TEST(SO3, LeftJacobians) {
  for (const Vector6d& xi : tangents()) {
    const Vector3d phi = xi.tail<3>();
    const Matrix3d J = leftJacobianSO3(phi);
    EXPECT_THAT(J * leftJacobianInverseSO3(phi), MatrixNear(Matrix3d(Matrix3d::Identity()), 1e-12));
    // Jl(phi) = R Jr(phi), Jr(phi) = Jl(-phi)
    EXPECT_THAT(J, MatrixNear(expSO3(phi).toRotationMatrix() * leftJacobianSO3(-phi), 1e-12));
  }
}

TEST(SO3, ExpIsUnitAndAngleBetweenIsItsAngle) {
  for (const Vector6d& xi : tangents()) {
    const Eigen::Quaterniond q = expSO3(xi.tail<3>());
    EXPECT_NEAR(q.norm(), 1, 1e-15);
    EXPECT_NEAR(angleBetween(Eigen::Quaterniond::Identity(), q), xi.tail<3>().norm(), 1e-12);
  }
}

TEST(SE3, FromMatrixOrthonormalises) {
  Eigen::Matrix4d m = SE3{expSO3({0.3, 0.2, 0.1}), {1, 2, 3}}.matrix();
  m.topLeftCorner<3, 3>() *= 1.001;
  const SE3 T = SE3::fromMatrix(m);
  EXPECT_NEAR(T.rotation.norm(), 1, 1e-15);
  EXPECT_THAT(T, PoseNear((SE3{expSO3({0.3, 0.2, 0.1}), {1, 2, 3}}), 1e-12, 2e-3));
}

}  // namespace
}  // namespace diorama
