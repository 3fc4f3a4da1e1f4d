#include "tracker/look_cue.h"

#include <gmock/gmock.h>

#include "tests/support/matchers.h"
#include "tests/tracker/box_scene.h"

namespace diorama {
namespace {

const Vector3d kCentre(0, 0, 0.1);

// What is seen of the box is known from the same side.
struct LookCueTest : testing::Test {
  test::BoxScene scene;
  SE3 T = test::boxPose();
  Frame frame = scene.draw(T, 0);
  DatabaseLook look = takeLook(frame, scene.camera, scene.rays, 0, T, kCentre);

  SE3 align(const SE3& start, const DatabaseLook& known, int most_points = 1000) const {
    const MeanImage means(frame);
    LookCue cue(known, means, scene.camera, kCentre, most_points);
    Cue* const cues[] = {&cue};
    const SE3 shift{Eigen::Quaterniond::Identity(), kCentre};
    SolverLimits limits;
    limits.iterations = 10;
    limits.model_diameter = 0.25;
    return solvePose(start * shift, cues, limits).T_camera_model * shift.inverse();
  }
  SE3 movedBy(double m, double rad) const {
    Vector6d step;
    step << m, -m, m, rad, rad, -rad;
    return T * exp(step);
  }
};

TEST_F(LookCueTest, MovesTheObjectToWhereItLooksAsKnown) {
  const SE3 moved = movedBy(0.003, 0.02);
  EXPECT_THAT(align(moved, look), test::PoseNear(T, 0.001, 0.006));
  // Large patches tell the way from further off.
  const SE3 far = movedBy(0.004, 0.03);
  const DatabaseLook coarse = coarser(look);
  EXPECT_LT(coarse.points.size(), look.points.size() / 2);
  const SE3 nearer = align(far, coarse);
  EXPECT_THAT(align(nearer, look), test::PoseNear(T, 0.001, 0.006));
}

// Another light on each side, and something dark in front of a corner.
TEST_F(LookCueTest, LightAndCoversDoNotMatter) {
  for (int y = 0; y < frame.gray.height; ++y)
    for (int x = 0; x < frame.gray.width; ++x) {
      uint8_t& grey = frame.gray(x, y);
      grey = static_cast<uint8_t>(0.7 * grey);
      if (const Vector2d u = *scene.camera.project(T * Vector3d(0.05, 0.05, 0.2));
          (u - Vector2d(x, y)).norm() < 12)
        grey = 5;
    }
  for (size_t i = 0; i < look.points.size(); ++i)
    if (look.normals[i].x() > 0.9f)
      look.colors[i].r = look.colors[i].g = look.colors[i].b =
          static_cast<uint8_t>(0.6 * look.colors[i].g);
  EXPECT_THAT(align(movedBy(0.003, 0.02), look), test::PoseNear(T, 0.0015, 0.01));
}

TEST_F(LookCueTest, NothingIsKnownOrSeen) {
  const SE3 behind{T.rotation, Vector3d(0, 0, -1)};
  for (const SE3& start : {T, behind}) {
    const MeanImage means(frame);
    EXPECT_EQ(LookCue(DatabaseLook(), means, scene.camera, kCentre, 10).linearise(start).residuals,
              0);
  }
  const MeanImage means(frame);
  EXPECT_EQ(LookCue(look, means, scene.camera, kCentre, 100).linearise(behind).residuals, 0);
  EXPECT_EQ(LookCue(look, means, scene.camera, kCentre, -1).linearise(T).residuals, 0);
  EXPECT_TRUE(coarser(DatabaseLook()).points.empty());
  EXPECT_TRUE(nearestLook({}, T, kCentre).points.empty());
}

}  // namespace
}  // namespace diorama
