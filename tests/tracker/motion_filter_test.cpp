#include "tracker/motion_filter.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <limits>

#include "core/random.h"

namespace diorama {
namespace {

constexpr double kFrame_s = 1.0 / 30;

Vector6d twist(double x, double y, double z, double a, double b, double c) {
  Vector6d xi;
  xi << x, y, z, a, b, c;
  return xi;
}

SE3 inFront() { return {expSO3({0.4, -0.8, 0.3}), {0.05, -0.02, 0.7}}; }

// Precise in all directions but one, of which it says nothing.
Matrix6d blindAlong(int direction) {
  Matrix6d information = 1e6 * Matrix6d::Identity();
  information(direction, direction) = 0;
  return information;
}

// For a second, each pose known well; the last one.
SE3 moveSteadily(MotionFilter& filter, const Vector6d& velocity) {
  SE3 T = inFront();
  filter.start(T, 1e-6 * Matrix6d::Identity());
  for (int k = 0; k < 30; ++k) {
    T = T * exp(kFrame_s * velocity);
    filter.correct(kFrame_s, T, 1e6 * Matrix6d::Identity());
  }
  return T;
}

TEST(MotionFilter, PredictsSteadyMotion) {
  const Vector6d velocity = twist(0.1, -0.05, 0.02, 0.3, -0.2, 0.5);
  MotionFilter filter;
  const SE3 T = moveSteadily(filter, velocity);
  const SE3 next = T * exp(kFrame_s * velocity);
  EXPECT_LT(log(filter.predict(kFrame_s).T_camera_model.inverse() * next).norm(), 1e-4);
}

// What is measured roughly is known the better for the frames before.
TEST(MotionFilter, SmoothsWhatTheImageHardlyKnows) {
  const Random random(7, RandomStream::kTest);
  const double rough = 0.05;  // rad, about one axis
  SE3 T = inFront();
  MotionFilter filter;
  filter.start(T, 1e-4 * Matrix6d::Identity());
  Matrix6d information = 1e6 * Matrix6d::Identity();
  information(4, 4) = 1 / (rough * rough);
  double squares = 0;
  int count = 0;
  for (uint32_t k = 0; k < 400; ++k) {
    T = T * exp(kFrame_s * twist(0.05, 0, 0, 0, 0.2, 0));
    const PosePrior prior = filter.predict(kFrame_s);
    Vector6d noise = Vector6d::Zero();
    noise[4] = rough * random.normal(k, 0)[0];
    const Vector6d by_prior = log(T.inverse() * prior.T_camera_model);
    const Matrix6d both = prior.information + information;
    const Vector6d joined = both.ldlt().solve(prior.information * by_prior + information * noise);
    filter.correct(kFrame_s, T * exp(joined), information);
    if (k < 150) continue;
    squares += joined[4] * joined[4];
    ++count;
  }
  EXPECT_LT(std::sqrt(squares / count), 0.75 * rough);
}

TEST(MotionFilter, StaysDefiniteWhereNothingIsEverMeasured) {
  SE3 T = inFront();
  MotionFilter filter;
  filter.start(T, 1e-4 * Matrix6d::Identity());
  for (int k = 0; k < 5000; ++k) {
    T = T * exp(kFrame_s * twist(0.02, 0, 0.01, 0, 0.1, 0.05));
    filter.correct(kFrame_s, T, blindAlong(k % 6));
    const PosePrior prior = filter.predict(kFrame_s);
    const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(prior.information);
    ASSERT_GT(solver.eigenvalues()[0], 0) << k;
    ASSERT_TRUE(prior.information.allFinite()) << k;
  }
}

TEST(MotionFilter, AJumpTellsNothingOfTheVelocity) {
  const Vector6d velocity = twist(0.1, 0, 0, 0, 0, 0.2);
  MotionFilter filter;
  const SE3 T = moveSteadily(filter, velocity);
  const SE3 elsewhere = T * exp(twist(0.02, 0, 0, 0, 0.3, 0));
  filter.jump(kFrame_s, elsewhere, 1e-6 * Matrix6d::Identity());
  const SE3 camera_moved = T * exp(kFrame_s * velocity) * T.inverse();  // goes on doing so
  const SE3 expected = camera_moved * elsewhere;
  EXPECT_LT(log(filter.predict(kFrame_s).T_camera_model.inverse() * expected).norm(), 1e-4);
}

// After a motion that no steady hand makes the image is believed.
TEST(MotionFilter, AJerkOutweighsThePrediction) {
  MotionFilter filter;
  filter.start(inFront(), 1e-6 * Matrix6d::Identity());
  for (int k = 0; k < 200; ++k) filter.correct(kFrame_s, inFront(), 1e6 * Matrix6d::Identity());
  const PosePrior prior = filter.predict(kFrame_s);
  EXPECT_EQ(prior.weightOf(inFront()), 1);
  EXPECT_LT(prior.weightOf(inFront() * exp(twist(0.1, 0, 0, 0, 0.5, 0))), 0.1);
}

// It learns how restless the camera is: the same prediction is then less certain.
TEST(MotionFilter, LearnsHowRestlessTheCameraIs) {
  const Random random(3, RandomStream::kTest);
  const auto uncertaintyAfter = [&](double acceleration) {
    SE3 T = inFront();
    Vector6d velocity = Vector6d::Zero();
    MotionFilter filter;
    filter.start(T, 1e-6 * Matrix6d::Identity());
    for (uint32_t k = 0; k < 300; ++k) {
      velocity.head<3>() += kFrame_s * acceleration * random.normal(k, 0)[0] * Vector3d::UnitX();
      velocity.tail<3>() += kFrame_s * acceleration * random.normal(k, 1)[0] * Vector3d::UnitY();
      T = T * exp(kFrame_s * velocity);
      filter.correct(kFrame_s, T, 1e8 * Matrix6d::Identity());
    }
    return 1 / filter.predict(kFrame_s).information.trace();
  };
  EXPECT_GT(uncertaintyAfter(10), 10 * uncertaintyAfter(0.1));
}

TEST(MotionFilter, WhatIsNotFiniteEndsIt) {
  MotionFilter filter;
  filter.start(inFront(), 1e-6 * Matrix6d::Identity());
  filter.correct(kFrame_s, inFront(), std::numeric_limits<double>::infinity() * blindAlong(2));
  EXPECT_FALSE(filter.started());
  filter.start(inFront(), 1e-6 * Matrix6d::Identity());
  EXPECT_TRUE(filter.predict(kFrame_s).information.allFinite());
}

TEST(PriorCue, PullsTowardsThePrediction) {
  PosePrior prior{inFront(), 1e4 * Matrix6d::Identity()};
  prior.information(0, 3) = prior.information(3, 0) = 2e3;
  const Vector6d off = twist(0.004, -0.002, 0.003, 0.005, 0.01, -0.004);
  PriorCue cue(prior);
  const CueEquations equations = cue.linearise(prior.T_camera_model * exp(off));
  EXPECT_EQ(equations.residuals, 0);  // it does not count as something seen
  const Vector6d step = -equations.hessian.ldlt().solve(equations.gradient);
  EXPECT_LT((step + off).norm(), 1e-3 * off.norm());
}

TEST(PriorCue, NothingExpectedChangesNothing) {
  PriorCue cue{PosePrior()};
  const CueEquations equations = cue.linearise(inFront());
  EXPECT_EQ(equations.hessian.norm(), 0);
  EXPECT_EQ(equations.gradient.norm(), 0);
}

}  // namespace
}  // namespace diorama
