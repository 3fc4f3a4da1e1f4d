#include "vo/start_trial.h"

#include <gtest/gtest.h>

namespace diorama {
namespace {

using namespace vo;

ObjectMeasurement seen(const std::string& name, const SE3& T_camera_object) {
  ObjectMeasurement m;
  m.object = name;
  m.T_camera_object = T_camera_object;
  m.covariance = 1e-6 * Matrix6d::Identity();
  m.health = 1;
  m.claimed = true;
  return m;
}

SE3 shifted(double x_m) { return {Eigen::Quaterniond::Identity(), Vector3d(x_m, 0, 1)}; }

class Discrepancy : public testing::Test {
 protected:
  Discrepancy() {
    for (const std::string name : {"box", "tin"})
      map_.objects[map_.objectIndex(name)].T_world_object = shifted(0);
  }
  std::optional<double> of(const std::vector<ObjectMeasurement>& objects) {
    return discrepancy(map_, SE3{}, objects, options_);
  }
  VoOptions options_;
  Map map_;
};

TEST_F(Discrepancy, IsInStandardDeviationsOfTheMeasurement) {
  options_.object_sigma_min_m = options_.object_sigma_min_rad = 0;
  EXPECT_NEAR(of({seen("box", shifted(0.003))}).value(), 9, 1e-6);
}

TEST_F(Discrepancy, IsThatOfTheObjectThatAgreesBest) {
  EXPECT_NEAR(of({seen("box", shifted(0.1)), seen("tin", shifted(0))}).value(), 0, 1e-9);
}

TEST_F(Discrepancy, NeedsAnObjectOfTheMapThatIsClaimed) {
  ObjectMeasurement lost = seen("box", shifted(0));
  lost.claimed = false;
  EXPECT_FALSE(of({seen("another", shifted(0)), lost}));
}

TEST(StartTrial, IsRefutedWhenMostOfTheLastFramesContradict) {
  const VoOptions options;
  StartTrial trial(options);
  for (const double d : {1.0, 2.0, 5.0}) trial.add(d);
  for (int k = 0; k < 3; ++k) trial.add(100);
  EXPECT_FALSE(trial.refuted());
  trial.add(100);
  EXPECT_TRUE(trial.refuted());
  trial.begin();
  EXPECT_FALSE(trial.refuted());
}

TEST(StartTrial, GoesOnWhileTheLastFramesBeginToContradict) {
  const VoOptions options;
  StartTrial trial(options);
  for (const double d : {4.5, 5.3, 3.3, 7.0, 16.1, 33.9, 39.6, 33.7}) trial.add(d);
  EXPECT_FALSE(trial.over());
  EXPECT_FALSE(trial.refuted());
  StartTrial other = trial;
  for (const double d : {51.8, 107.8}) trial.add(d);
  EXPECT_TRUE(trial.refuted());
  for (int k = 0; k < 8; ++k) other.add(3);
  EXPECT_TRUE(other.over()) << "it was something else";
}

TEST(StartTrial, EndsAfterItsFramesWhetherObjectsAreSeenOrNot) {
  VoOptions options;
  options.start_trial_frames = 3;
  StartTrial trial(options);
  for (int k = 0; k < 3; ++k) {
    EXPECT_FALSE(trial.over());
    trial.add(std::nullopt);
  }
  EXPECT_TRUE(trial.over());
  EXPECT_FALSE(trial.refuted());
}

}  // namespace
}  // namespace diorama
