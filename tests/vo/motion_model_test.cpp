// What is expected of a motion that nobody measures.
#include "vo/motion_model.h"

#include <gtest/gtest.h>

#include "core/random.h"
#include "tests/support/matchers.h"

namespace diorama::vo {
namespace {

using test::PoseNear;

constexpr double kStep_s = 1.0 / 30;
int64_t timeOf(int frame) { return frame * int64_t{33333333}; }
SE3 steady(int frame) {
  return {expSO3(Vector3d(0, 0.01 * frame, 0)), Vector3d(0.02 * frame, 0, 0.01 * frame)};
}

MotionModel after(int frames, bool certain = true) {
  MotionModel model;
  for (int k = 0; k < frames; ++k) model.add(timeOf(k), steady(k), certain);
  return model;
}

TEST(MotionModel, SaysNothingBeforeItKnowsHowTheCameraMoves) {
  EXPECT_FALSE(after(8).predict(timeOf(8)));
  EXPECT_FALSE(after(60, false).predict(timeOf(60)));
  EXPECT_TRUE(after(20).predict(timeOf(20)));
  EXPECT_FALSE(after(20).predict(timeOf(19)));  // the past
  EXPECT_FALSE(after(20).predict(timeOf(40)));  // too far off
}

TEST(MotionModel, GoesOnWithTheLastVelocity) {
  const auto prior = after(30).predict(timeOf(30));
  ASSERT_TRUE(prior);
  EXPECT_LT((prior->mean - steady(30).translation).norm(), 1e-9);
}

// Velocities that take a random walk of known strength.
TEST(MotionModel, LearnsTheStrengthOfTheRandomWalk) {
  const double q = 0.09;  // m^2/s^3
  const Random random(5, RandomStream::kTest);
  MotionModel model;
  Vector3d velocity(0.3, 0, 0), position = Vector3d::Zero();
  constexpr int kFine = 20;  // steps of the walk in each frame
  for (int k = 0; k < 3000; ++k) {
    model.add(timeOf(k), {Eigen::Quaterniond::Identity(), position}, true);
    for (int i = 0; i < kFine; ++i) {
      const uint64_t at = static_cast<uint64_t>(2 * i);
      const auto a = random.normal(static_cast<uint32_t>(k), at);
      const auto b = random.normal(static_cast<uint32_t>(k), at + 1);
      velocity += std::sqrt(q * kStep_s / kFine) * Vector3d(a[0], a[1], b[0]);
      position += kStep_s / kFine * velocity;
    }
  }
  EXPECT_GT(model.strength().value(), 0.8 * q);
  EXPECT_LT(model.strength().value(), 4 * q);  // there is a margin in it
}

TEST(MotionModel, ACameraAtRestMayStartToMove) {
  MotionModel model;
  for (int k = 0; k < 40; ++k) model.add(timeOf(k), SE3{}, true);
  const auto prior = model.predict(timeOf(40));
  ASSERT_TRUE(prior);
  EXPECT_GT(std::sqrt(prior->variance), 2e-4);
}

TEST(MotionModel, CoastsAndSlowsDown) {
  const MotionModel model = after(30);
  EXPECT_THAT(model.coast(timeOf(29), timeOf(30)),
              PoseNear(steady(29).inverse() * steady(30), 1e-3, 1e-3));
  const SE3 whole = model.coast(timeOf(29), timeOf(1000));
  EXPECT_LT(whole.translation.norm(), 31 * 0.023);  // a second's way, no more
  const SE3 parts = model.coast(timeOf(29), timeOf(40)) * model.coast(timeOf(40), timeOf(1000));
  EXPECT_THAT(parts, PoseNear(whole, 1e-9, 1e-9));
  EXPECT_THAT(MotionModel().coast(0, timeOf(3)), PoseNear(SE3{}, 1e-15, 1e-15));
}

TEST(MotionModel, AJumpIsNoMotion) {
  MotionModel model = after(30);
  model.forgetMotion();
  model.add(timeOf(31), steady(300), true);
  EXPECT_FALSE(model.predict(timeOf(32)));
  EXPECT_TRUE(model.strength());
}

}  // namespace
}  // namespace diorama::vo
