// Each factor's residual and Jacobians, the manifold, the kernels.
#include <ceres/cost_function.h>
#include <ceres/loss_function.h>
#include <ceres/manifold.h>
#include <gtest/gtest.h>

#include <limits>

#include "mapper/object_factor.h"
#include "mapper/odometry_factor.h"
#include "mapper/se3_manifold.h"
#include "tests/mapper/synthetic_graph.h"

namespace diorama {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)

Matrix6d randomCovariance(Numbers& numbers) {
  Matrix6d L = Matrix6d::Zero();
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j <= i; ++j) L(i, j) = i == j ? numbers.uniform(0.5, 2) : numbers.normal();
  return L * L.transpose();
}

TEST(RelativePose, JacobiansMatchNumericOnes) {
  Numbers numbers(1);
  for (int i = 0; i < 50; ++i) {
    const SE3 a = numbers.pose(2), b = numbers.pose(2);
    // Residuals from tiny to large.
    const SE3 Z = a.inverse() * b * exp(Vector6d((i % 5) * 0.2 * numbers.normal6()));
    const LinearisedPair pair = linearise(Z, a, b);
    EXPECT_THAT(pair.J_a, MatrixNear(numericPoseJacobian(
                                         [&](const SE3& T) { return linearise(Z, T, b).r; }, a),
                                     1e-6));
    EXPECT_THAT(pair.J_b, MatrixNear(numericPoseJacobian(
                                         [&](const SE3& T) { return linearise(Z, a, T).r; }, b),
                                     1e-6));
  }
}

// By the seven numbers, as Ceres uses it: (cost Jacobian) * (Plus Jacobian) = derivative by xi.
template <class Factor>
void checkCost(const Factor& factor, const SE3& a, const SE3& b, Numbers&) {
  const auto cost = makeCost(factor);
  const PoseBlock block_a = toBlock(a), block_b = toBlock(b);
  const double* blocks[] = {block_a.data(), block_b.data()};
  Vector6d residual;
  Matrix67d J_a, J_b;
  double* jacobians[] = {J_a.data(), J_b.data()};
  ASSERT_TRUE(cost->Evaluate(blocks, residual.data(), jacobians));
  const auto residualAt = [&](const SE3& x, const SE3& y) {
    const PoseBlock block_x = toBlock(x), block_y = toBlock(y);
    const double* values[] = {block_x.data(), block_y.data()};
    Vector6d r;
    EXPECT_TRUE(cost->Evaluate(values, r.data(), nullptr));
    return r;
  };
  EXPECT_THAT(
      J_a * blockByTangent(a),
      MatrixNear(numericPoseJacobian([&](const SE3& T) { return residualAt(T, b); }, a), 1e-5));
  EXPECT_THAT(
      J_b * blockByTangent(b),
      MatrixNear(numericPoseJacobian([&](const SE3& T) { return residualAt(a, T); }, b), 1e-5));
}

TEST(OdometryFactor, CostJacobiansMatchNumericOnes) {
  Numbers numbers(2);
  for (int i = 0; i < 20; ++i) {
    const SE3 a = numbers.pose(2), b = numbers.pose(2);
    OdometryMeasurement m{"",
                          0,
                          1,
                          a.inverse() * b * exp(Vector6d(0.1 * numbers.normal6())),
                          randomCovariance(numbers),
                          1};
    const OdometryFactorResult result = makeOdometryFactor(m, 1);
    ASSERT_TRUE(result.factor) << result.reason;
    checkCost(*result.factor, a, b, numbers);
  }
}

TEST(OdometryFactor, OfUnknownScaleHasRightJacobians) {
  Numbers numbers(6);
  for (int i = 0; i < 20; ++i) {
    const SE3 a = numbers.pose(2), b = numbers.pose(2);
    const SE3 Z = a.inverse() * b * exp(Vector6d(0.1 * numbers.normal6()));
    OdometryFactor factor =
        *makeOdometryFactor({"", 0, 1, Z, randomCovariance(numbers), 1}, 1).factor;
    factor.scale = 0;
    const auto residualAt = [&](const SE3& x, const SE3& y, double s) -> Vector6d {
      return factor.W.matrix() * log(scaled(Z, s).inverse() * (x.inverse() * y));
    };
    const double s = numbers.uniform(-0.2, 0.2), h = 1e-6;
    const LinearisedStep step = linearise(factor, {}, a, b, s);
    EXPECT_THAT(step.r, MatrixNear(residualAt(a, b, s), 1e-12));
    const Vector6d by_s = (residualAt(a, b, s + h) - residualAt(a, b, s - h)) / (2 * h);
    EXPECT_THAT(step.J_scale, MatrixNear(by_s, 1e-5 * by_s.norm()));
    const PoseBlock blocks[] = {toBlock(a), toBlock(b), toBlock({{1, 0, 0, 0}, {s, 0, 0}})};
    const double* parameters[] = {blocks[0].data(), blocks[1].data(), blocks[2].data()};
    Vector6d residual;
    Matrix67d by_scale;
    double* jacobians[] = {nullptr, nullptr, by_scale.data()};
    ASSERT_TRUE(makeCost(factor)->Evaluate(parameters, residual.data(), jacobians));
    EXPECT_THAT(residual, MatrixNear(step.r, 1e-12));
    EXPECT_THAT(Vector6d(by_scale.col(0)), MatrixNear(step.J_scale, 1e-12));
    EXPECT_EQ(by_scale.rightCols(6).norm(), 0);
  }
}

TEST(ObjectFactor, APriorDoesNotKnowTheCamera) {
  Numbers numbers(7);
  const SE3 camera = numbers.pose(2), object = numbers.pose(2);
  const ObjectFactor prior{0, object, {}, true};
  const LinearisedPair pair = linearise(prior, {}, camera, object);
  EXPECT_LT(pair.r.norm(), 1e-12);
  EXPECT_EQ(pair.J_a.norm(), 0);
  EXPECT_THAT(pair.J_b, MatrixNear(Matrix6d(Matrix6d::Identity()), 1e-9));
}

TEST(ObjectFactor, CostJacobiansMatchNumericOnes) {
  Numbers numbers(3);
  for (int i = 0; i < 20; ++i) {
    const SE3 a = numbers.pose(2), b = numbers.pose(2);
    ObjectMeasurement m{"",
                        "o",
                        0,
                        a.inverse() * b * exp(Vector6d(0.1 * numbers.normal6())),
                        randomCovariance(numbers),
                        1,
                        true,
                        ""};
    const ObjectFactorResult result = makeObjectFactor(m, 0, 1);
    ASSERT_TRUE(result.factor) << result.reason;
    checkCost(*result.factor, a, b, numbers);
  }
}

TEST(ObjectFactor, LinearisedFormCarriesTheRootOfTheWeight) {
  const ObjectFactor factor{0, SE3{}, {}};
  const RobustKernel kernel{RobustKernel::Kind::kHuber, 2};
  const SE3 object = exp((Vector6d() << 8, 0, 0, 0, 0, 0).finished());  // |r| = 8, weight 2 / 8
  const LinearisedPair pair = linearise(factor, kernel, SE3{}, object);
  EXPECT_NEAR(pair.r.norm(), 8 * 0.5, 1e-12);
  EXPECT_NEAR(pair.J_b(3, 3), 0.5, 1e-12);
}

TEST(Whitening, GivesTheInverseOfTheCovariance) {
  Numbers numbers(4);
  for (int i = 0; i < 20; ++i) {
    const Matrix6d P = randomCovariance(numbers);
    const Matrix6d W = whitening(P).value().matrix();
    EXPECT_THAT(W * P * W.transpose(), MatrixNear(Matrix6d(Matrix6d::Identity()), 1e-5));
  }
}

TEST(Whitening, IsAnyRootButForTheDirectionOfTheResidual) {
  Numbers numbers(5);
  for (int i = 0; i < 20; ++i) {
    const Matrix6d root =
        whitening(randomCovariance(numbers)).value().matrix() * adjoint(numbers.pose(1));
    const Vector6d r = numbers.normal6();
    const double length = (root * r).norm();
    EXPECT_NEAR((Whitening(root).matrix() * r).norm(), length, 1e-6 * length);
  }
}

TEST(Whitening, RefusesWhatIsNoCovariance) {
  const Matrix6d identity = Matrix6d::Identity();
  Matrix6d m = identity;
  m(3, 3) = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(whitening(m));
  m = identity;
  m(0, 1) = 0.1;
  EXPECT_FALSE(whitening(m)) << "not symmetric";
  m = identity;
  m(0, 1) = m(1, 0) = 1;
  EXPECT_FALSE(whitening(m)) << "singular";
  m(0, 1) = m(1, 0) = 2;
  EXPECT_FALSE(whitening(m)) << "indefinite";
  EXPECT_FALSE(whitening(Matrix6d::Zero()));
  EXPECT_FALSE(whitening(1e13 * identity));
  // A standard deviation of 1e-9 counts as 1e-6.
  EXPECT_NEAR(whitening(1e-18 * identity).value().matrix()(0, 0), 1e6, 1);
}

TEST(GapFactor, GrowsWithTheTime) {
  const OdometryFactor factor = makeGapFactor(0.5, 2, 4);
  EXPECT_NEAR(factor.W.matrix()(0, 0), 1, 1e-12);
  EXPECT_NEAR(factor.W.matrix()(5, 5), 0.5, 1e-12);
}

TEST(SE3Manifold, PlusIsARightPerturbationAndMinusItsInverse) {
  Numbers numbers(5);
  const auto manifold = makeSE3Manifold();
  for (int i = 0; i < 50; ++i) {
    const SE3 T = numbers.pose(3);
    const Vector6d xi = 0.5 * numbers.normal6();
    const PoseBlock x = toBlock(T);
    PoseBlock y{};
    ASSERT_TRUE(manifold->Plus(x.data(), xi.data(), y.data()));
    EXPECT_THAT(fromBlock(y.data()), PoseNear(T * exp(xi), 1e-14, 1e-14));
    Vector6d back;
    ASSERT_TRUE(manifold->Minus(y.data(), x.data(), back.data()));
    EXPECT_THAT(back, MatrixNear(xi, 1e-12));
  }
}

TEST(SE3Manifold, JacobiansMatchNumericOnes) {
  Numbers numbers(6);
  const auto manifold = makeSE3Manifold();
  for (int i = 0; i < 20; ++i) {
    const SE3 T = numbers.pose(3);
    const PoseBlock x = toBlock(T);
    Matrix76d plus;
    Matrix67d minus;
    ASSERT_TRUE(manifold->PlusJacobian(x.data(), plus.data()));
    ASSERT_TRUE(manifold->MinusJacobian(x.data(), minus.data()));
    const auto block = [&](const Vector6d& xi) {
      PoseBlock y{};
      manifold->Plus(x.data(), xi.data(), y.data());
      return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(y.data(), 7));
    };
    EXPECT_THAT(plus, MatrixNear(numericJacobian(block, Vector6d(Vector6d::Zero())), 1e-8));
    EXPECT_THAT(minus * plus, MatrixNear(Matrix6d(Matrix6d::Identity()), 1e-14));
  }
}

TEST(RobustKernel, SlopesAndCurvaturesMatchNumericOnes) {
  for (const char* name : {"none", "huber", "cauchy", "cauchy_tail"}) {
    const RobustKernel kernel{kernelFromString(name).value(), 2};
    for (double s : {0.0, 0.5, 3.0, 5.0, 40.0, 1e4}) {
      const double h = 1e-5 * (1 + s);
      const RobustKernel::Value value = kernel(s), up = kernel(s + h), down = kernel(s - h);
      EXPECT_NEAR(value.slope, (up.rho - down.rho) / (2 * h), 1e-6) << name << " at " << s;
      EXPECT_NEAR(value.curvature, (up.slope - down.slope) / (2 * h), 1e-6) << name << " at " << s;
    }
    EXPECT_NEAR(kernel(4 - 1e-9).rho, kernel(4 + 1e-9).rho, 1e-8) << name;
  }
  EXPECT_FALSE(kernelFromString("tukey"));
  EXPECT_EQ(makeLoss({}), nullptr);
  double rho[3];
  makeLoss({RobustKernel::Kind::kHuber, 2})->Evaluate(16, rho);
  EXPECT_DOUBLE_EQ(rho[0], 12);
  EXPECT_DOUBLE_EQ(rho[1], 0.5);
}

}  // namespace
}  // namespace diorama
