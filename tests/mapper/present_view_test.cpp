#include "mapper/present_view.h"

#include <gtest/gtest.h>

#include "tests/mapper/synthetic_graph.h"

namespace diorama {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)

constexpr double kGate = 22.46;

Matrix6d covarianceOf(double sigma) { return sigma * sigma * Matrix6d::Identity(); }

SE3 shifted(double x) { return {Eigen::Quaterniond::Identity(), {x, 0, 1}}; }

TEST(PresentView, OfEqualsIsHalfWay) {
  const ObjectPrediction joined =
      joinMeasurement({shifted(0), covarianceOf(1e-3)}, shifted(2e-3), covarianceOf(1e-3), kGate);
  EXPECT_THAT(joined.T_camera_object.matrix(), MatrixNear(shifted(1e-3).matrix(), 1e-8));
  // Errors that may be the same ones do not average out.
  EXPECT_THAT(joined.covariance, MatrixNear(covarianceOf(1e-3), 1e-8));
}

TEST(PresentView, EachDirectionGoesToWhoKnowsItBetter) {
  Matrix6d P = covarianceOf(1e-4);
  P(0, 0) = 1e-4;
  const ObjectPrediction joined = joinMeasurement(
      {shifted(0), P}, {expSO3({0, 0.01, 0}), {5e-3, 0, 1}}, covarianceOf(3e-3), kGate);
  EXPECT_NEAR(joined.T_camera_object.translation.x(), 5e-3 * 1e-4 / (1e-4 + 9e-6), 2e-5);
  EXPECT_NEAR(angleBetween(joined.T_camera_object.rotation, Eigen::Quaterniond::Identity()),
              0.01 / 901, 1e-5);
}

// Random errors as they are said to be: the covariance is not too small, and the joined pose is
// better than either.
TEST(PresentView, IsBetterThanBothOfIndependentOnes) {
  Numbers numbers(3);
  double believed = 0, measured = 0, together = 0, nees = 0;
  constexpr int kTimes = 2000;
  for (int i = 0; i < kTimes; ++i) {
    const SE3 truth = numbers.pose(1);
    const auto err = [&](const SE3& T) { return log(T.inverse() * truth).squaredNorm(); };
    const ObjectPrediction belief{truth * exp(Vector6d(1e-3 * numbers.normal6())),
                                  covarianceOf(1e-3)};
    const SE3 Z = truth * exp(Vector6d(2e-3 * numbers.normal6()));
    const ObjectPrediction joined = joinMeasurement(belief, Z, covarianceOf(2e-3), kGate);
    const Vector6d e = log(joined.T_camera_object.inverse() * truth);
    believed += err(belief.T_camera_object);
    measured += err(Z);
    together += err(joined.T_camera_object);
    nees += e.dot(joined.covariance.inverse() * e);
  }
  EXPECT_LT(together, 0.9 * believed);
  EXPECT_LT(together, 0.9 * measured);
  EXPECT_LT(nees / kTimes, 6);
}

TEST(PresentView, WhatDisagreesMovesItTheLessTheMoreItDoes) {
  const auto moved = [](double x) {
    return joinMeasurement({shifted(0), covarianceOf(1e-3)}, shifted(x), covarianceOf(1e-4), kGate)
        .T_camera_object.translation.x();
  };
  EXPECT_GT(moved(4e-3), 3.9e-3);  // 4 sigmas
  EXPECT_LT(moved(0.02), 0.019);   // 20
  EXPECT_LT(moved(0.2), 0.06);
  EXPECT_LT(moved(2), 0.01);
}

TEST(PresentView, StaysFiniteWhereOneKnowsNothingOrAll) {
  for (const double P : {1e-12, 1.0, 1e6})
    for (const double R : {1e-12, 1.0, 1e6}) {
      const ObjectPrediction joined =
          joinMeasurement({shifted(0), covarianceOf(P)}, shifted(0.1), covarianceOf(R), kGate);
      EXPECT_TRUE(joined.T_camera_object.isFinite());
      EXPECT_TRUE(joined.covariance.allFinite());
    }
}

}  // namespace
}  // namespace diorama
