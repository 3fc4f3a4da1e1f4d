#include "vo/corners.h"

#include <gtest/gtest.h>

#include <set>

#include "tests/support/matchers.h"

namespace diorama::vo {
namespace {

constexpr int kField = 48;  // more than the window of the coarsest level

// Smoothed over a pixel at the edges of the fields.
Image<uint8_t> chequers(double low, double high) {
  Image<uint8_t> image(480, 384);
  const auto side = [](int x) { return x % kField == 0 ? 0.5 : (x / kField) % 2; };
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const double a = side(x), b = side(y), mixed = a + b - 2 * a * b;
      image(x, y) = static_cast<uint8_t>(low + (high - low) * mixed + 0.5);
    }
  return image;
}

std::vector<Corner> detect(const Image<uint8_t>& image, const CellGrid& grid,
                           const std::vector<uint8_t>& occupied, int count = 1000) {
  return detectCorners(ImagePyramid(image, 4), imageNoise(image), grid, occupied, count, {});
}

TEST(Corners, AreWhereFieldsMeetOnePerCell) {
  const Image<uint8_t> image = chequers(60, 180);
  const CellGrid grid(image.width, image.height, kField);
  const auto corners = detect(image, grid, std::vector<uint8_t>(grid.size(), 0));
  EXPECT_GE(corners.size(), 50u);
  std::set<size_t> cells;
  for (const Corner& corner : corners) {
    EXPECT_TRUE(cells.insert(grid.cellOf(corner.u_px)).second);
    const Vector2d nearest = (corner.u_px / kField).array().round() * kField;
    EXPECT_LT((corner.u_px - nearest).norm(), 3.0) << corner.u_px.transpose();
  }
  for (size_t i = 1; i < corners.size(); ++i) EXPECT_GE(corners[i - 1].score, corners[i].score);
}

TEST(Corners, LeaveOccupiedCellsAndKeepTheStrongest) {
  const Image<uint8_t> image = chequers(60, 180);
  const CellGrid grid(image.width, image.height, kField);
  std::vector<uint8_t> occupied(grid.size(), 1);
  EXPECT_TRUE(detect(image, grid, occupied).empty());
  occupied.assign(grid.size(), 0);
  EXPECT_EQ(detect(image, grid, occupied, 7).size(), 7u);
  EXPECT_TRUE(detect(image, grid, occupied, -3).empty());
}

TEST(Corners, WeakOnesCountInACleanImageOnly) {
  const Image<uint8_t> weak = chequers(100, 112);
  const CellGrid grid(weak.width, weak.height, kField);
  const std::vector<uint8_t> free(grid.size(), 0);
  EXPECT_GE(detect(weak, grid, free).size(), 50u);

  test::Numbers numbers(5);
  Image<uint8_t> noise(weak.width, weak.height);
  for (uint8_t& pixel : noise.pixels) pixel = static_cast<uint8_t>(120 + 8 * numbers.normal());
  EXPECT_LE(detect(noise, grid, free).size(), 3u);
}

// A slanted edge without smoothing is a staircase.
TEST(Corners, StepsOfStraightEdgesAreNone) {
  for (const double slope : {0.04, 0.11, 0.17, 0.26, 0.34, 0.51, 0.69, 0.83, 1.0}) {
    Image<uint8_t> image(400, 400);
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) image(x, y) = y > slope * x + 0.3 ? 180 : 60;
    const CellGrid grid(image.width, image.height, 20);
    EXPECT_LE(detect(image, grid, std::vector<uint8_t>(grid.size(), 0)).size(), 1u) << slope;
  }
}

TEST(Corners, BlankAndTinyImagesHaveNone) {
  const CellGrid grid(100, 80, 20);
  const std::vector<uint8_t> free(grid.size(), 0);
  EXPECT_TRUE(detect(Image<uint8_t>(100, 80, 90), grid, free).empty());
  const CellGrid tiny(3, 2, 20);
  EXPECT_TRUE(detect(Image<uint8_t>(3, 2, 90), tiny, std::vector<uint8_t>(tiny.size(), 0)).empty());
}

}  // namespace
}  // namespace diorama::vo
