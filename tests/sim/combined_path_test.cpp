// Paths made of paths.
#include <gtest/gtest.h>

#include <cmath>

#include "sim/motion_path.h"

namespace diorama {
namespace {

MotionPathPtr rest(const Vector3d& position, const Vector3d& target) {
  return makeSplinePath({{0, lookAt(position, target)}});
}

MotionPathPtr moving() {
  return makeSplinePath({{0, lookAt({1, 0, 0.5}, {0, 0, 0})},
                         {0.5, lookAt({0.8, 0.4, 0.6}, {0, 0.1, 0})},
                         {1.2, lookAt({0.2, 0.9, 0.3}, {0.1, 0, 0})}});
}

struct Velocity {
  Vector3d linear, angular;
};
Velocity velocity(const MotionPath& path, double time_s, double step_s) {
  const SE3 a = path.pose(time_s), b = path.pose(time_s + step_s);
  return {(b.translation - a.translation) / step_s,
          logSO3(a.rotation.conjugate() * b.rotation) / step_s};
}

TEST(SequencePath, SegmentsKeepTheirPosesAndOwnTime) {
  const auto path = makeSequencePath(
      {{moving(), 1, 0.5}, {rest({0, 0, 1}, {1, 0, 0}), 2, 0.5}, {moving(), 1, 1}});
  for (double t : {0.0, 0.3, 1.0}) {
    EXPECT_EQ(path->pose(t).translation, moving()->pose(t).translation) << t;
    EXPECT_LT((path->pose(t + 4).translation - moving()->pose(t).translation).norm(), 1e-12) << t;
  }
  EXPECT_EQ(path->pose(-0.5).translation, moving()->pose(-0.5).translation);
  for (double t : {1.5, 2.0, 3.5})
    EXPECT_LT((path->pose(t).translation - Vector3d(0, 0, 1)).norm(), 1e-12);
}

TEST(SequencePath, JointsHaveNoJumpInPoseOrVelocity) {
  const auto path = makeSequencePath(
      {{moving(), 1, 0.4}, {moving(), 0.7, 0.2}, {rest({0, 0, 1}, {1, 1, 0}), 1, 1}});
  const double h = 1e-5;
  for (double joint : {1.0, 1.4, 2.1, 2.3}) {
    const SE3 before = path->pose(joint - 1e-9), after = path->pose(joint + 1e-9);
    EXPECT_LT((before.translation - after.translation).norm(), 1e-7) << joint;
    EXPECT_LT(angleBetween(before.rotation, after.rotation), 1e-7) << joint;
    const Velocity left = velocity(*path, joint, -h), right = velocity(*path, joint, h);
    EXPECT_LT((left.linear - right.linear).norm(), 1e-3) << joint;
    EXPECT_LT((left.angular - right.angular).norm(), 1e-3) << joint;
  }
  EXPECT_GT(velocity(*path, 1.0, h).linear.norm(), 0.3) << "it does not stop in between";
}

TEST(ShakenPath, HasTheAmplitudesAndStaysInItsBand) {
  const Shake shake{0.004, 0.01, 2, 6, 5};
  const auto path = makeShakenPath(rest({0, 0, 0}, {1, 0, 0}), shake);
  const SE3 still = rest({0, 0, 0}, {1, 0, 0})->pose(0);
  Vector6d power = Vector6d::Zero(), speed = Vector6d::Zero();
  const int count = 60000;
  const double step = 1e-3;
  for (int k = 0; k < count; ++k) {
    const Vector6d a = log(still.inverse() * path->pose(k * step));
    const Vector6d b = log(still.inverse() * path->pose((k + 1) * step));
    power += a.cwiseAbs2() / count;
    speed += ((b - a) / step).cwiseAbs2() / count;
  }
  for (int axis = 0; axis < 6; ++axis) {
    EXPECT_NEAR(std::sqrt(power[axis]), axis < 3 ? 0.004 : 0.01, axis < 3 ? 0.0004 : 0.001);
    // The mean frequency, weighted by power.
    const double hz = std::sqrt(speed[axis] / power[axis]) / (2 * M_PI);
    EXPECT_GT(hz, 2);
    EXPECT_LT(hz, 6);
  }
}

TEST(ShakenPath, IsAFunctionOfItsSeed) {
  const auto at = [](uint64_t seed) {
    return makeShakenPath(rest({0, 0, 0}, {1, 0, 0}), {0.01, 0.01, 1, 5, seed})
        ->pose(0.7)
        .translation;
  };
  EXPECT_EQ(at(1), at(1));
  EXPECT_NE(at(1), at(2));
}

TEST(GlancingPath, TurnsAwayAndComesBack) {
  const MotionPathPtr still = rest({0, 0, 0}, {1, 0, 0});
  const auto path = makeGlancingPath(still, {{2, 5, 0.5, [](double) -> Vector3d {
                                                return {0, -1, 0};
                                              }}});
  for (double t : {0.0, 2.0, 5.0, 9.0})
    EXPECT_EQ(angleBetween(path->pose(t).rotation, still->pose(t).rotation), 0) << t;
  for (double t : {2.5, 3.0, 4.5})
    EXPECT_LT((path->pose(t).rotation * Vector3d::UnitZ() - Vector3d(0, -1, 0)).norm(), 1e-9) << t;
  EXPECT_LT(velocity(*path, 2.0, 1e-3).angular.norm(), 1e-3);
}

}  // namespace
}  // namespace diorama
