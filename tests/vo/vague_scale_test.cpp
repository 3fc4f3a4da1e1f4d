#include "vo/vague_scale.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/matchers.h"

namespace diorama::vo {
namespace {

const SE3 kForward{Eigen::Quaterniond::Identity(), Vector3d(0.01, 0, 0)};

TEST(VagueScale, AStraightWayIsAsVagueAsItIsLong) {
  VagueScale scale;
  double sum = 0;
  for (int k = 0; k < 100; ++k) sum += scale.add(kForward, 0.5)(0, 0);
  EXPECT_NEAR(std::sqrt(sum), 0.5, 0.01);
}

TEST(VagueScale, WaysBackAddTheirStepsOnly) {
  VagueScale scale;
  for (int k = 0; k < 100; ++k) scale.add(kForward, 1);
  EXPECT_NEAR(scale.add(kForward.inverse(), 1)(0, 0), 1e-4, 1e-12);
  scale.begin();
  EXPECT_NEAR(scale.add(kForward, 1)(0, 0), 2e-4, 1e-12);
}

TEST(VagueScale, IsAlongTheStepAsTheNewCameraSeesIt) {
  VagueScale scale;
  const SE3 turned{expSO3(Vector3d(0, 0, M_PI / 2)), Vector3d(0.01, 0, 0)};
  const Matrix6d covariance = scale.add(turned, 1);
  EXPECT_NEAR(covariance(1, 1), 2e-4, 1e-12);
  EXPECT_NEAR(covariance.trace(), 2e-4, 1e-12);
}

TEST(VagueScale, AStepWithoutLengthHasNone) {
  VagueScale scale;
  EXPECT_TRUE(scale.add(SE3{}, 1).isZero(0));
  EXPECT_TRUE(scale.add(kForward, 0).isZero(0));
}

}  // namespace
}  // namespace diorama::vo
