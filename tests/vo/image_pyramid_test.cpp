#include "vo/image_pyramid.h"

#include <gtest/gtest.h>

#include <limits>

#include "tests/support/matchers.h"

namespace diorama::vo {
namespace {

Image<uint8_t> ramp(int width, int height) {
  Image<uint8_t> image(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) image(x, y) = static_cast<uint8_t>(x + 2 * y);
  return image;
}

TEST(ImagePyramid, HalvesByTheMeanAndStopsAtSmallImages) {
  const ImagePyramid pyramid(ramp(65, 40), 5);
  ASSERT_EQ(pyramid.levels(), 2);  // 32 x 20; 16 x 10 would be too small
  EXPECT_EQ(pyramid.level(1).width, 32);
  EXPECT_EQ(pyramid.level(1).height, 20);
  // Pixels 6, 7 of rows 4, 5: 14, 15, 16, 17, rounded half up.
  EXPECT_EQ(pyramid.level(1)(3, 2), 16);
}

TEST(ImagePyramid, ATinyImageIsOneLevel) {
  EXPECT_EQ(ImagePyramid(Image<uint8_t>(1, 1, 7), 5).levels(), 1);
}

TEST(ImagePyramid, LevelsKeepPixelCentres) {
  // Pixel 0 of level 1 has its centre between pixels 0 and 1.
  EXPECT_DOUBLE_EQ(toLevel(Vector2d(0.5, 2.5), 1).x(), 0);
  EXPECT_DOUBLE_EQ(toLevel(Vector2d(0.5, 2.5), 1).y(), 1);
  const Vector2d u(13.3, 7.9);
  EXPECT_THAT(fromLevel(toLevel(u, 3), 3), test::MatrixNear(u, 1e-12));
}

TEST(SampleBlock, ReadsBetweenPixels) {
  float block[16];
  ASSERT_TRUE(sampleBlock<4>(ramp(20, 20), {10.25, 8.5}, block));
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x)
      EXPECT_FLOAT_EQ(block[4 * y + x], static_cast<float>(8.25 + x + 2 * (6.5 + y)));
}

TEST(SampleBlock, RefusesWhatLeavesTheImage) {
  const Image<uint8_t> image = ramp(20, 20);
  const double nan = std::numeric_limits<double>::quiet_NaN(),
               infinity = std::numeric_limits<double>::infinity();
  float block[16];
  for (const Vector2d& centre : {Vector2d(1.9, 10), Vector2d(10, 1.9), Vector2d(18, 10),
                                 Vector2d(10, 18), Vector2d(nan, 10), Vector2d(10, infinity)})
    EXPECT_FALSE(sampleBlock<4>(image, centre, block)) << centre.transpose();
  EXPECT_TRUE(sampleBlock<4>(image, {17.9, 2}, block));
}

TEST(ImageNoise, IsFoundBesideStructure) {
  test::Numbers numbers(3);
  Image<uint8_t> image(200, 150);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      image(x, y) = static_cast<uint8_t>(60 + (x / 20 % 2) * 90 + 4 * numbers.normal() + 0.5);
  EXPECT_NEAR(imageNoise(image), 4, 0.5);
  EXPECT_EQ(imageNoise(Image<uint8_t>(200, 150, 80)), 0);
  EXPECT_EQ(imageNoise(Image<uint8_t>(2, 2, 80)), 0);
}

}  // namespace
}  // namespace diorama::vo
