#include "app/replay_odometry.h"

#include <gtest/gtest.h>

#include "core/random.h"
#include "tests/support/fakes.h"

namespace diorama {
namespace {

constexpr int64_t kMs = 1'000'000;  // ns

SE3 motion(double x, double turn) {
  return exp((Vector6d() << x, 0.1 * x, 0, 0, turn, 0.2 * turn).finished());
}

std::vector<OdometryMeasurement> threeSteps() {
  std::vector<OdometryMeasurement> steps;
  for (int k = 0; k < 3; ++k)
    steps.push_back({"sensor", 10 * k * kMs, 10 * (k + 1) * kMs, motion(0.1 + 0.05 * k, 0.2),
                     test::covarianceOf(0.01), 1});
  return steps;
}

Frame frameAt(int64_t time_ms) { return {0, time_ms * kMs, {}, {}}; }

TEST(ReplayOdometry, GivesEachStepAsItWasRecorded) {
  ReplayOdometry odometry(threeSteps(), "replay");
  EXPECT_FALSE(odometry.track(frameAt(0)).has_value());
  const auto m = odometry.track(frameAt(10));
  ASSERT_TRUE(m.has_value());
  EXPECT_EQ(m->T_from_to.matrix(), (SE3{} * threeSteps()[0].T_from_to).matrix());
  EXPECT_EQ(m->source, "replay");
  EXPECT_EQ(m->health, 1);
}

TEST(ReplayOdometry, ComposesStepsOverFramesThatWereLeftOut) {
  ReplayOdometry odometry(threeSteps(), "replay");
  odometry.track(frameAt(0));
  const auto m = odometry.track(frameAt(30));
  ASSERT_TRUE(m.has_value());
  const auto steps = threeSteps();
  const SE3 product = steps[0].T_from_to * steps[1].T_from_to * steps[2].T_from_to;
  EXPECT_LT(log(product.inverse() * m->T_from_to).norm(), 1e-12);
}

TEST(ReplayOdometry, ComposedCovarianceAgreesWithSamples) {
  const auto steps = threeSteps();
  ReplayOdometry odometry(steps, "replay");
  odometry.track(frameAt(0));
  const auto m = odometry.track(frameAt(30));
  ASSERT_TRUE(m.has_value());
  const Random random(7, RandomStream::kTest);
  Matrix6d sample = Matrix6d::Zero();
  constexpr int n = 20000;
  for (int i = 0; i < n; ++i) {
    SE3 product;
    for (size_t k = 0; k < 3; ++k) {
      const auto a = random.normal(static_cast<uint32_t>(i), 2 * k),
                 b = random.normal(static_cast<uint32_t>(i), 2 * k + 1);
      const Vector6d noise = 0.01 * (Vector6d() << a[0], a[1], a[2], a[3], b[0], b[1]).finished();
      product = product * steps[k].T_from_to * exp(noise);
    }
    const Vector6d e = log(m->T_from_to.inverse() * product);
    sample += e * e.transpose() / n;
  }
  EXPECT_LT((sample - m->covariance).norm() / m->covariance.norm(), 0.03);
}

TEST(ReplayOdometry, TimesMayBeRounded) {
  auto steps = threeSteps();
  for (OdometryMeasurement& step : steps) step.from_ns += 333, step.to_ns -= kMs / 3;
  ReplayOdometry odometry(steps, "replay");
  EXPECT_FALSE(odometry.track(frameAt(0)).has_value());
  EXPECT_TRUE(odometry.started());
  for (const int64_t time_ms : {10, 20, 30}) {
    const auto m = odometry.track(frameAt(time_ms));
    EXPECT_EQ(m->health, 1);
    EXPECT_EQ(m->to_ns, time_ms * kMs);
  }
  ReplayOdometry late(threeSteps(), "replay");
  late.track({0, kMs, {}, {}});
  EXPECT_EQ(late.track(frameAt(10))->health, 0);
}

TEST(ReplayOdometry, AGapIsNotHealthy) {
  auto steps = threeSteps();
  steps.erase(steps.begin() + 1);
  ReplayOdometry odometry(steps, "replay");
  odometry.track(frameAt(0));
  EXPECT_EQ(odometry.track(frameAt(10))->health, 1);
  EXPECT_EQ(odometry.track(frameAt(20))->health, 0);
  EXPECT_EQ(odometry.track(frameAt(30))->health, 1);
}

}  // namespace
}  // namespace diorama
