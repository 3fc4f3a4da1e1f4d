// What the raster renderer's truth is found with.
#include "sim/candidate_triangles.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <numeric>

#include "sim/narrow_triangles.h"
#include "tests/sim/scene_support.h"

namespace diorama {
namespace {

using test::object;
using test::plainScene;
using test::square;
using test::Workshop;

TEST(CandidateTriangles, OneSurfaceIsJoinedByEdges) {
  const Workshop workshop("candidates");
  Scene scene = plainScene();
  const auto file = workshop.write("p.obj", square(0.5));
  scene.objects = {object("near", file, Vector3d(1, 0, 0)), object("far", file, Vector3d(2, 0, 0))};
  const RenderScene triangles = makeRenderScene(scene);  // 0 and 1 near, 2 and 3 far
  const auto oneSurface = [&](std::initializer_list<uint32_t> ids) {
    CandidateTriangles candidates;
    for (const uint32_t id : ids) candidates.add(id);
    return candidates.formOneSurface(triangles);
  };
  EXPECT_TRUE(oneSurface({1, 1, 1}));
  EXPECT_TRUE(oneSurface({1, 2, 1, 2}));
  EXPECT_FALSE(oneSurface({1, 3}));
  EXPECT_FALSE(oneSurface({1, 2, 3, 4}));
  EXPECT_FALSE(oneSurface({0}));
  EXPECT_FALSE(oneSurface({1, 0, 1}));

  const SE3 T_camera_world = scene.path->pose(0).inverse();
  NearestTriangles rays;
  std::iota(rays.x.begin(), rays.x.end(), 0.0);
  for (double& x : rays.x) x = 0.012 + 0.04 * x;  // to 0.292: beyond both squares
  for (const uint32_t triangle : {2u, 3u, 0u, 1u})
    CameraTriangle(triangles, T_camera_world, triangle).meet(rays);
  for (size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(rays.triangle[i] >= 0, rays.x[i] < 0.25);
    if (rays.x[i] < 0.25) {
      EXPECT_LT(rays.triangle[i], 2);
      EXPECT_NEAR(rays.depth[i], 1, 1e-6);
    }
  }
}

// A view along z of triangles in the plane z = 1, in pixels.
int marksOf(const std::vector<Vector3f>& corners_px, std::vector<uint8_t>& marks) {
  const PinholeView view{40, 30, 100, 100, 0, 0};
  RenderScene scene;
  for (const Vector3f& p : corners_px) {
    scene.indices.push_back(static_cast<uint32_t>(scene.corners.size()));
    scene.corners.push_back({p.x() / 100 * p.z(), p.y() / 100 * p.z(), p.z()});
  }
  marks.assign(40 * 30, 0);
  markNarrowTriangles(scene, SE3{}, view, marks);
  return std::accumulate(marks.begin(), marks.end(), 0);
}

TEST(NarrowTriangles, AreMarkedAlongTheirWholeLength) {
  std::vector<uint8_t> marks;
  // Wherever a point of the triangle is, the pixel nearest to it and its neighbours are marked.
  const Vector2d a(3.3, 4.6), b(35.2, 21.9), c(20.1, 13.1);
  EXPECT_GT(marksOf({{3.3f, 4.6f, 1}, {35.2f, 21.9f, 1}, {20.1f, 13.1f, 1}}, marks), 90);
  for (int i = 0; i <= 200; ++i)
    for (int j = 0; i + j <= 200; ++j) {
      const Vector2d p = a + (b - a) * (i / 200.0) + (c - a) * (j / 200.0);
      const auto x = std::lround(p.x()), y = std::lround(p.y());
      ASSERT_TRUE(marks[static_cast<size_t>(y * 40 + x)]) << p.transpose();
    }
  EXPECT_EQ(marks[3 * 40 + 30], 0);
  EXPECT_EQ(marks[25 * 40 + 10], 0);
}

TEST(NarrowTriangles, WideOnesAndThoseOutsideAreNot) {
  std::vector<uint8_t> marks;
  EXPECT_EQ(marksOf({{3, 4, 1}, {35, 20, 1}, {20, 15, 1}}, marks), 0) << "wider than a pixel";
  EXPECT_EQ(marksOf({{-30, 4, 1}, {-3, 4, 1}, {-3, 4.4f, 1}}, marks), 0) << "beside the view";
  EXPECT_EQ(marksOf({{3, 4, -1}, {30, 4, -1}, {30, 4.4f, -1}}, marks), 0) << "behind it";
  EXPECT_EQ(marksOf({{3, 4, 0}, {30, 4, 1}, {30, 4.4f, 1}}, marks), 0) << "through the camera";
  EXPECT_EQ(marksOf({{10, 10, 1}, {10, 10, 1}, {10, 10, 1}}, marks), 9) << "a point";
  // A line that is a million pixels long is marked within the view alone, and at once.
  EXPECT_GE(marksOf({{-1e6f, 10, 1}, {1e6f, 10, 1}, {0, 10.4f, 1}}, marks), 40 * 3);
}

}  // namespace
}  // namespace diorama
