#include "vo/edgelets.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/support/matchers.h"
#include "vo/epipolar_search.h"

namespace diorama::vo {
namespace {

// A straight edge through the image's centre, smoothed over two pixels. The normal points to the
// bright side, which is `shift` px farther along it.
Image<uint8_t> drawEdge(const Vector2d& normal, double contrast, double shift = 0) {
  Image<uint8_t> image(400, 300);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const double d = normal.dot(Vector2d(x - 200, y - 150)) - shift;
      image(x, y) = static_cast<uint8_t>(100 + contrast * std::clamp(0.5 + d / 2, 0.0, 1.0) + 0.5);
    }
  return image;
}

std::vector<Corner> detect(const Image<uint8_t>& image, const CellGrid& grid, int count = 1000) {
  return detectEdgelets(ImagePyramid(image, 4), imageNoise(image), grid,
                        std::vector<uint8_t>(grid.size(), 0), count, {});
}

TEST(Edgelets, LieOnAnEdgeOnePerCell) {
  for (const double angle : {0.0, 0.4, 1.1, 2.6}) {
    const Vector2d normal(std::cos(angle), std::sin(angle));
    const Image<uint8_t> image = drawEdge(normal, 80);
    const CellGrid grid(image.width, image.height, 20);
    const auto edgelets = detect(image, grid);
    EXPECT_GE(edgelets.size(), 10u) << angle;
    std::set<size_t> cells;
    for (const Corner& edgelet : edgelets) {
      EXPECT_TRUE(cells.insert(grid.cellOf(edgelet.u_px)).second);
      EXPECT_LT(std::abs(normal.dot(edgelet.u_px - Vector2d(200, 150))), 3.0) << angle;
    }
    EXPECT_EQ(detect(image, grid, 4).size(), 4u);
    EXPECT_TRUE(detect(image, grid, -1).empty());
  }
}

TEST(Edgelets, AreNotInOccupiedCellsNorInNoiseNorInNothing) {
  const Image<uint8_t> image = drawEdge({1, 0}, 80);
  const CellGrid grid(image.width, image.height, 20);
  EXPECT_TRUE(
      detectEdgelets(ImagePyramid(image, 4), 0, grid, std::vector<uint8_t>(grid.size(), 1), 100, {})
          .empty());
  test::Numbers numbers(5);
  Image<uint8_t> noise(400, 300);
  for (uint8_t& pixel : noise.pixels) pixel = static_cast<uint8_t>(120 + 8 * numbers.normal());
  EXPECT_LE(detect(noise, grid).size(), 3u);
  EXPECT_TRUE(detect(Image<uint8_t>(400, 300, 90), grid).empty());
  const CellGrid tiny(3, 2, 20);
  EXPECT_TRUE(detect(Image<uint8_t>(3, 2, 90), tiny).empty());
}

const Camera& camera() {
  static const Camera camera(
      CameraParameters{CameraModel::kPinhole, 400, 300, 400, 400, 200, 150, {}});
  return camera;
}

// A wall with an edge on it, 2 m before two cameras 10 cm apart: the edge moves by 20 px.
EpipolarMatch depthOfEdge(const Vector2d& normal, const Vector2d& motion_px) {
  Keyframe host;
  host.pyramid = std::make_shared<const ImagePyramid>(drawEdge(normal, 80), 4);
  TrackedFrame frame;
  frame.pyramid =
      std::make_shared<const ImagePyramid>(drawEdge(normal, 80, normal.dot(motion_px)), 4);
  frame.T_world_camera.translation.head<2>() = -motion_px / 200;
  const Vector2d u(200, 150);
  return searchEpipolar(camera(), {&host, u, *camera().unproject(u), 0, true}, frame, 0.3, 0.8, {});
}

TEST(Edgelets, HaveADepthFromASecondViewAcrossThem) {
  for (const double angle : {0.0, 0.5, -0.8, 3.1}) {
    const EpipolarMatch match = depthOfEdge({std::cos(angle), std::sin(angle)}, {20, 0});
    ASSERT_EQ(match.outcome, EpipolarOutcome::kFound) << angle;
    EXPECT_NEAR(match.depth.value, 0.5, 0.005) << angle;
    EXPECT_LT(std::abs(match.depth.value - 0.5), 3 * match.depth.sigma) << angle;
    EXPECT_LT(match.depth.sigma, 0.02) << angle;
  }
}

TEST(Edgelets, AlongWhichTheCameraMovesHaveNoDepth) {
  EXPECT_EQ(depthOfEdge({0, 1}, {20, 0}).outcome, EpipolarOutcome::kNotVisible);
  EXPECT_EQ(depthOfEdge({0.2, 0.98}, {20, 0}).outcome, EpipolarOutcome::kNotVisible);
}

}  // namespace
}  // namespace diorama::vo
