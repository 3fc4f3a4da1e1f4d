#include "vo/feature_alignment.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/matchers.h"

namespace diorama::vo {
namespace {

using Picture = double (*)(double x, double y);

double blobs(double x, double y) {
  return 110 + 50 * std::sin(0.45 * x) * std::cos(0.38 * y) + 20 * std::sin(0.2 * (x + y));
}
double edge(double x, double) { return 110 + 60 * std::tanh((x - 30) / 1.5); }

// The picture, moved by `shift` and made brighter.
Image<uint8_t> draw(Picture picture, const Vector2d& shift, double gain = 1, double offset = 0) {
  Image<uint8_t> image(60, 60);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      image(x, y) = static_cast<uint8_t>(
          std::clamp(gain * picture(x - shift.x(), y - shift.y()) + offset + 0.5, 0.0, 255.0));
  return image;
}

std::optional<Patch> patchAt(Picture picture, const Vector2d& u) {
  return cutPatch(ImagePyramid(draw(picture, Vector2d::Zero()), 1), u, 0);
}

TEST(FeatureAlignment, FindsAFractionOfAPixelUnderOtherLight) {
  const auto patch = patchAt(blobs, {30, 28});
  ASSERT_TRUE(patch);
  const Vector2d shift(1.3, -0.8);
  const auto found = alignFeature(draw(blobs, shift, 0.8, 25), *patch, Vector2d(30, 28), 5, true);
  ASSERT_TRUE(found);
  EXPECT_THAT(found->u_level, test::MatrixNear(Vector2d(31.3, 27.2), 0.04));
  EXPECT_NEAR(found->gain, 0.8, 0.03);  // interpolation blurs
  EXPECT_LT(found->rms, 1);
}

TEST(FeatureAlignment, WithoutGainOnlyTheOffsetIsFound) {
  const auto patch = patchAt(blobs, {30, 28});
  const auto found =
      alignFeature(draw(blobs, {0.5, 0.5}, 1, 30), *patch, Vector2d(30, 28), 5, false);
  ASSERT_TRUE(found);
  EXPECT_THAT(found->u_level, test::MatrixNear(Vector2d(30.5, 28.5), 0.04));
  EXPECT_EQ(found->gain, 1);
}

TEST(FeatureAlignment, IsUncertainAlongAnEdge) {
  const auto patch = patchAt(edge, {30, 30});
  ASSERT_TRUE(patch);
  test::Numbers numbers(2);
  Image<uint8_t> noisy = draw(edge, {0.3, 0});
  for (uint8_t& pixel : noisy.pixels) pixel = static_cast<uint8_t>(pixel + 2 * numbers.normal());
  const auto found = alignFeature(noisy, *patch, Vector2d(30, 30), 8, true);
  if (!found) GTEST_SKIP() << "it may as well slide away";
  EXPECT_GT(found->covariance(1, 1), 100 * found->covariance(0, 0));
}

TEST(FeatureAlignment, AnEdgeletMovesAcrossItsEdgeOnly) {
  const auto patch = patchAt(edge, {30, 30});
  ASSERT_TRUE(patch);
  test::Numbers numbers(2);
  Image<uint8_t> noisy = draw(edge, {0.7, 0}, 0.8, 20);
  for (uint8_t& pixel : noisy.pixels) pixel = static_cast<uint8_t>(pixel + 2 * numbers.normal());
  const auto found = alignFeature(noisy, *patch, Vector2d(30, 30), 5, true, true);
  ASSERT_TRUE(found);
  EXPECT_THAT(found->u_level, test::MatrixNear(Vector2d(30.7, 30), 0.06));
  EXPECT_THAT(found->normal, test::MatrixNear(Vector2d(1, 0), 0.02));
  EXPECT_LT(found->covariance(0, 0), 0.01);
  EXPECT_GT(found->covariance(1, 1), 100 * found->covariance(0, 0));
  // Nothing to align by.
  const auto blank = cutPatch(ImagePyramid(Image<uint8_t>(60, 60, 90), 1), {30, 30}, 0);
  const auto nothing = alignFeature(noisy, *blank, Vector2d(30, 30), 5, true, true);
  EXPECT_TRUE(!nothing || nothing->normal.allFinite());
}

TEST(FeatureAlignment, GivesUpFarAwayOutsideAndOnNothing) {
  const auto patch = patchAt(blobs, {30, 28});
  const Image<uint8_t> image = draw(blobs, {4, 0});
  EXPECT_FALSE(alignFeature(image, *patch, Vector2d(30, 28), 1.5, true));
  EXPECT_FALSE(alignFeature(image, *patch, Vector2d(2, 28), 5, true));
  EXPECT_FALSE(alignFeature(image, *patch, Vector2d(NAN, 28), 5, true));
  // A blank image is no dim copy of the patch.
  EXPECT_FALSE(alignFeature(Image<uint8_t>(60, 60, 90), *patch, Vector2d(30, 28), 5, true));
  EXPECT_FALSE(alignFeature(Image<uint8_t>(3, 3, 90), *patch, Vector2d(1, 1), 5, true));
}

TEST(Patch, WarpedWithoutMotionIsTheCut) {
  const ImagePyramid pyramid(draw(blobs, Vector2d::Zero()), 1);
  const Camera camera(CameraParameters{CameraModel::kPinhole, 60, 60, 50, 50, 29.5, 29.5, {}});
  const Vector2d u(28.25, 31.5);
  const auto cut = cutPatch(pyramid, u, 0);
  const auto warped = warpPatch(camera, pyramid, u, 0, *camera.unproject(u) * 2, SE3{}, 1);
  ASSERT_TRUE(cut && warped);
  for (size_t k = 0; k < cut->bordered.size(); ++k)
    EXPECT_NEAR(warped->bordered[k], cut->bordered[k], 1e-3f);
}

TEST(Patch, IsLargerFromNearAndTurnsWithTheCamera) {
  const ImagePyramid pyramid(draw(blobs, Vector2d::Zero()), 1);
  const Camera camera(CameraParameters{CameraModel::kPinhole, 60, 60, 50, 50, 29.5, 29.5, {}});
  const Vector2d centre(29.5, 29.5);
  // A quarter turn about the axis: what was right of the centre is above it.
  const SE3 turned{expSO3(Vector3d(0, 0, -M_PI / 2)), Vector3d::Zero()};
  const auto patch = warpPatch(camera, pyramid, centre, 0, Vector3d(0, 0, 2), turned, 1);
  ASSERT_TRUE(patch);
  EXPECT_NEAR(patch->at(4, 4), blobs(29.5, 29.5), 2);
  EXPECT_NEAR(patch->at(4, 4 - 3), blobs(29.5 + 3, 29.5), 2);
  // Half as far: two pixels there are one here.
  const SE3 nearer{Eigen::Quaterniond::Identity(), Vector3d(0, 0, -1)};
  const auto large = warpPatch(camera, pyramid, centre, 0, Vector3d(0, 0, 2), nearer, 1);
  ASSERT_TRUE(large);
  EXPECT_NEAR(large->at(4 + 2, 4), blobs(29.5 + 1, 29.5), 2);
}

TEST(Patch, IsNoneOutsideTheImageOrBehindTheCamera) {
  const ImagePyramid pyramid(draw(blobs, Vector2d::Zero()), 1);
  const Camera camera(CameraParameters{CameraModel::kPinhole, 60, 60, 50, 50, 29.5, 29.5, {}});
  EXPECT_FALSE(cutPatch(pyramid, {3, 30}, 0));
  EXPECT_FALSE(warpPatch(camera, pyramid, {30, 30}, 0, Vector3d(0, 0, 1),
                         SE3{Eigen::Quaterniond::Identity(), Vector3d(0, 0, -1.5)}, 1));
  EXPECT_FALSE(warpPatch(camera, pyramid, {30, 30}, 0, Vector3d(0, 0, 1),
                         SE3{Eigen::Quaterniond::Identity(), Vector3d(0, 0, 50)}, 1));
}

}  // namespace
}  // namespace diorama::vo
