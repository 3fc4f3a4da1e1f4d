#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/matchers.h"
#include "vo/motion_report.h"

namespace diorama::vo {
namespace {

// Points 2 m ahead, whose depths are known within 2 cm.
class ScaleVariance : public ::testing::Test {
 protected:
  TrackedFrame frameOf(size_t first, size_t count) {
    TrackedFrame frame;
    for (size_t k = first; k < first + count; ++k) {
      Feature feature;
      feature.point = &points_[k];
      frame.features.push_back(feature);
    }
    return frame;
  }
  void SetUp() override {
    points_.resize(100);
    for (MapPoint& point : points_) {
      point.p_world = {0, 0, 2};
      point.covariance(2, 2) = 0.02 * 0.02;
    }
  }

  std::vector<MapPoint> points_;
};

TEST_F(ScaleVariance, OfManyDepthsIsSmallAndOfFewLarge) {
  EXPECT_NEAR(std::sqrt(scaleVariance(frameOf(0, 100), {})), 0.001, 1e-9);
  EXPECT_NEAR(std::sqrt(scaleVariance(frameOf(0, 4), {})), 0.005, 1e-9);
}

TEST_F(ScaleVariance, StaysWhereNothingThatIsSettledIsSeen) {
  TrackedFrame before;
  before.scale_variance = 1e-3;
  EXPECT_EQ(scaleVariance({}, before), 1e-3);
}

TEST_F(ScaleVariance, IsHandedOnToWhatIsSettled) {
  for (size_t k = 50; k < 100; ++k) points_[k].settled = false;
  TrackedFrame bridge = frameOf(0, 1);
  bridge.scale_variance = scaleVariance(bridge, {});  // 1%, from a single known point
  for (size_t k = 50; k < 100; ++k) settle(bridge, points_[k]);
  EXPECT_NEAR(std::sqrt(scaleVariance(frameOf(50, 50), {})), 0.01, 2e-4);
  EXPECT_NEAR(std::sqrt(scaleVariance(frameOf(0, 50), {})), 0.02 / 2 / std::sqrt(50), 1e-9);
  TrackedFrame later;
  later.scale_variance = 1;
  settle(later, points_[50]);
  EXPECT_NEAR(points_[50].scale_variance, 1e-4, 1e-9) << "what is settled stays so";
}

TEST_F(ScaleVariance, IsInTheStepsOnVagueGroundOnly) {
  const VoOptions options;
  MotionReport report("vo", options);
  report.begin(0, {});
  TrackedFrame last, now;
  const auto alongVariance = [&](double scale_sigma) {
    last = now;
    now.timestamp_ns += 1;
    now.T_world_camera.translation.x() += 0.03;
    now.scale_variance = scale_sigma * scale_sigma;
    return report.step(last, now, 1e12 * Matrix6d::Identity(), 0).covariance(0, 0);
  };
  const double certain = alongVariance(0);
  for (int k = 0; k < 10; ++k) EXPECT_LT(alongVariance(0.001), certain + 1e-8);
  double sum = 0;
  for (int k = 0; k < 10; ++k) sum += alongVariance(0.05) - certain;
  EXPECT_NEAR(std::sqrt(sum), 0.05 * 0.3, 0.003) << "5% of the way over it";
}

}  // namespace
}  // namespace diorama::vo
