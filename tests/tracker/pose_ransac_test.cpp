#include "tracker/pose_ransac.h"

#include <gmock/gmock.h>

#include "tests/support/matchers.h"
#include "tests/tracker/box_scene.h"

namespace diorama {
namespace {

const Random kRandom(3, RandomStream::kTest);
constexpr double kDiameter = 0.25;

Camera camera() {
  return Camera{CameraParameters{
      CameraModel::kRadTan, 640, 480, 520, 520, 320, 240, {-0.1, 0.04, 0.001, -0.001}}};
}

// Points on a box seen from boxPose(), with half a pixel of noise; then pixels anywhere.
std::vector<PointMatch> makeMatches(int right, int wrong) {
  const SE3 T = test::boxPose();
  const Vector3d eye = T.inverse().translation;
  std::vector<PointMatch> matches;
  for (int i = 0; i < right + wrong; ++i) {
    const auto u = kRandom.uniform(0, static_cast<uint64_t>(i));
    const auto n = kRandom.normal(1, static_cast<uint64_t>(i));
    const Vector3d p(0.1 * u[0] - 0.05, 0.1 * u[1] - 0.05, 0.2 * u[2]);
    Vector2d pixel = *camera().project(T * p) + 0.5 * Vector2d(n[0], n[1]);
    if (i >= right) {
      const auto v = kRandom.uniform(2, static_cast<uint64_t>(i));
      pixel = Vector2d(640 * v[0], 480 * v[1]);
    }
    matches.push_back({p, (eye - p).normalized(), pixel});
  }
  return matches;
}

class PoseRansac : public ::testing::TestWithParam<const char*> {
 protected:
  PoseRansac() { options_.solver = GetParam(); }
  DetectorOptions options_;
};

TEST_P(PoseRansac, FindsThePoseAmongWrongMatches) {
  options_.samples = 2000;
  const auto found = findPose(makeMatches(40, 40), camera(), kDiameter, options_, kRandom, 0);
  ASSERT_TRUE(found);
  EXPECT_THAT(found->T_camera_object, test::PoseNear(test::boxPose(), 2e-3, 0.01));
  EXPECT_GE(found->inliers.size(), 38u);
  EXPECT_LE(found->inliers.size(), 44u);
}

TEST_P(PoseRansac, FindsNothingWhereNothingIs) {
  options_.min_inliers = 8;
  EXPECT_FALSE(findPose(makeMatches(0, 60), camera(), kDiameter, options_, kRandom, 0));
  EXPECT_FALSE(findPose({}, camera(), kDiameter, options_, kRandom, 0));
  EXPECT_FALSE(findPose(makeMatches(7, 0), camera(), kDiameter, options_, kRandom, 0));
}

TEST_P(PoseRansac, GivesTheSameTwice) {
  const auto a = findPose(makeMatches(30, 30), camera(), kDiameter, options_, kRandom, 5);
  const auto b = findPose(makeMatches(30, 30), camera(), kDiameter, options_, kRandom, 5);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->T_camera_object.translation, b->T_camera_object.translation);
  EXPECT_EQ(a->inliers, b->inliers);
}

INSTANTIATE_TEST_SUITE_P(Solvers, PoseRansac, ::testing::Values("p3p", "epnp"));

TEST(PoseRansac, WitnessesFromOneSpotDoNotCount) {
  std::vector<PointMatch> matches = makeMatches(30, 0);
  const Vector3d centre = matches[0].p_object;
  for (PointMatch& match : matches) match.p_object = centre + 0.01 * (match.p_object - centre);
  const SE3 T = test::boxPose();
  for (PointMatch& match : matches) match.u_px = *camera().project(T * match.p_object);
  EXPECT_FALSE(findPose(matches, camera(), kDiameter, {}, kRandom, 0));
}

TEST(AgreeingMatches, APlaceSeenFromBehindDoesNotAgree) {
  std::vector<PointMatch> matches = makeMatches(10, 0);
  EXPECT_EQ(agreeingMatches(matches, camera(), test::boxPose(), 5).size(), 10u);
  for (PointMatch& match : matches) match.view_direction = -match.view_direction;
  EXPECT_TRUE(agreeingMatches(matches, camera(), test::boxPose(), 5).empty());
}

TEST(TiltedTheOtherWay, ProjectsAFlatSideToNearlyTheSamePixels) {
  // The side x = 0.05 of a box, a metre away and seen at a slant.
  SE3 T = test::boxPose();
  T.translation = Vector3d(0, 0, 1);
  std::vector<PointMatch> matches = makeMatches(20, 0);
  std::vector<int> all;
  for (size_t i = 0; i < matches.size(); ++i) {
    matches[i].p_object.x() = 0.05;
    all.push_back(static_cast<int>(i));
  }
  const SE3 other = tiltedTheOtherWay(T, matches, all);
  EXPECT_GT(angleBetween(other.rotation, T.rotation), 0.2);
  double worst_px = 0;
  for (const PointMatch& match : matches)
    worst_px = std::max(
        worst_px,
        (*camera().project(other * match.p_object) - *camera().project(T * match.p_object)).norm());
  EXPECT_LT(worst_px, 12);  // of some 100 px
  EXPECT_THAT(tiltedTheOtherWay(other, matches, all), test::PoseNear(T, 1e-9, 1e-9));
}

}  // namespace
}  // namespace diorama
