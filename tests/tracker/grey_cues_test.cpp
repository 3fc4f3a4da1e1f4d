// Direct alignment, texture patches, corners and the pyramid under them.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/tracker/box_scene.h"
#include "tests/tracker/pose_checks.h"
#include "tracker/corners.h"
#include "tracker/direct_alignment.h"
#include "tracker/texture_cue.h"

namespace diorama {
namespace {

struct GreyCues : testing::Test {
  test::BoxScene scene;
  TrackerOptions options;
  EdgeModel model = makeEdgeModel(test::boxMesh(), options);
  SE3 T = test::boxPose() * SE3{Eigen::Quaterniond::Identity(), model.centre_object};
  Frame frame = scene.draw(test::boxPose(), 0);
  ImagePyramid image;
  Print no_print{test::boxMesh(), model.centre_object, scene.camera, scene.rays, 0};
  void SetUp() override { image.build(frame.gray); }

  static SE3 moved(const SE3& T, double scale) {
    Vector6d xi;
    xi << 0.02, -0.015, 0.02, 0.05, 0.08, -0.06;
    return T * exp(scale * xi);
  }
};

TEST_F(GreyCues, PyramidKeepsPlaces) {
  // A ramp stays a ramp: the level's pixel has the value of the place it stands for.
  Image<uint8_t> ramp(64, 48);
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) ramp(x, y) = static_cast<uint8_t>(2 * x + y);
  ImagePyramid pyramid;
  pyramid.build(ramp);
  for (int l = 1; l < ImagePyramid::kLevels; ++l)
    for (double x = 10; x < 50; x += 3.7) {
      const double y = 20.3;
      EXPECT_NEAR(sampleBilinear(pyramid.level(l), static_cast<float>(toLevel(x, l)),
                                 static_cast<float>(toLevel(y, l))),
                  2 * x + y, 0.6);
    }
}

TEST_F(GreyCues, DirectAlignmentFindsALargeMotion) {
  DirectAlignment direct(model, scene.camera, scene.rays, 0, options);
  EXPECT_FALSE(direct.ready());
  direct.setReference(image, T, {});
  ASSERT_TRUE(direct.ready());
  for (const double scale : {-0.4, -0.2, 0.4, 1.0}) {
    const SE3 start = moved(T, scale);
    const DirectAlignment::Result result = direct.align(image, start);
    EXPECT_GT(test::pixelError(scene.camera, model, start, T), 10 * std::abs(scale));
    EXPECT_LT(test::pixelError(scene.camera, model, result.T_camera_model, T), 0.3) << scale;
    EXPECT_LT(result.cost, 1);
    EXPECT_LT(direct.screen(image, T, 1), direct.screen(image, start, 1));
  }
}

TEST_F(GreyCues, DirectAlignmentIgnoresBrightness) {
  DirectAlignment direct(model, scene.camera, scene.rays, 0, options);
  direct.setReference(image, T, {});
  Image<uint8_t> brighter = frame.gray;
  for (uint8_t& p : brighter.pixels) p = static_cast<uint8_t>(std::min(255, p + 20));
  ImagePyramid pyramid;
  pyramid.build(brighter);
  const DirectAlignment::Result result = direct.align(pyramid, moved(T, 0.5));
  EXPECT_LT(test::pixelError(scene.camera, model, result.T_camera_model, T), 0.3);
}

TEST_F(GreyCues, TextureAloneFindsThePose) {
  TextureCue texture(model, scene.camera, scene.rays, 0, options, options.texture_correlation);
  EXPECT_TRUE(texture.empty());
  texture.setKeyframe(frame.gray, T, Matrix6d::Zero(), {}, no_print);
  ASSERT_FALSE(texture.empty());
  const SE3 truth = test::boxPose(0.1) * SE3{Eigen::Quaterniond::Identity(), model.centre_object};
  const Frame next = scene.draw(test::boxPose(0.1), 1);
  const SE3 pose = test::poseByPatches(texture, next.gray, truth, model.diameter);
  EXPECT_LT(test::pixelError(scene.camera, model, pose, truth), 0.25);
  const TextureCue::Agreement agreement = texture.agreement(1.5);
  EXPECT_GE(agreement.expected, 15);
  EXPECT_GT(agreement.agreeing, 0.8 * agreement.expected);
  EXPECT_FALSE(texture.keyframeNeeded(pose));
  EXPECT_TRUE(texture.keyframeNeeded(pose * exp((Vector6d() << 0, 0, 0, 0, 0, 0.6).finished())));
}

TEST_F(GreyCues, TextureIsNotFoundWhereItIsNot) {
  TextureCue texture(model, scene.camera, scene.rays, 0, options, options.texture_correlation);
  texture.setKeyframe(frame.gray, T, Matrix6d::Zero(), {}, no_print);
  const Frame empty = scene.draw(test::boxPose(), 1, true);
  texture.align(empty.gray, T, {});
  texture.linearise(T);
  const TextureCue::Agreement agreement = texture.agreement(1.5);
  EXPECT_LT(agreement.agreeing, 0.2 * agreement.expected);
}

TEST(Corners, FindsTheCornersOfASquare) {
  Image<uint8_t> image(100, 80, 40);
  for (int y = 30; y < 50; ++y)
    for (int x = 40; x < 70; ++x) image(x, y) = 200;
  const std::vector<Vector2d> corners = findCorners(image, Vector2d(0, 0), Vector2d(99, 79), 9);
  ASSERT_GE(corners.size(), 4u);
  for (const Vector2d& expected :
       {Vector2d(40, 30), Vector2d(69, 30), Vector2d(40, 49), Vector2d(69, 49)}) {
    double nearest = 1e9;
    for (const Vector2d& c : corners) nearest = std::min(nearest, (c - expected).norm());
    EXPECT_LT(nearest, 3.5);
  }
  EXPECT_TRUE(findCorners(Image<uint8_t>(10, 10, 3), {0, 0}, {9, 9}, 9).empty());
  EXPECT_TRUE(findCorners(Image<uint8_t>(100, 80, 3), {1e9, 1e9}, {-1e9, -1e9}, 9).empty());
}

}  // namespace
}  // namespace diorama
