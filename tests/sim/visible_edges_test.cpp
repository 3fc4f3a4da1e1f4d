// Visible edges against geometry that is known exactly.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "sim/simulator.h"
#include "tests/sim/scene_support.h"

namespace diorama {
namespace {

using test::object;
using test::plainScene;
using test::square;
using test::Workshop;

std::vector<VisibleEdge> edgesOf(const Scene& scene, int threads = 1) {
  return *Simulator(scene, {RenderQuality::kDraft, threads, {.edges = true}}).read(0).truth->edges;
}

// The outline of a square whose top edge a nearer square hides in the middle.
TEST(VisibleEdges, AreCutWhereSomethingHidesThem) {
  const Workshop workshop("edge_cut");
  Scene scene = plainScene();
  scene.objects = {
      object("back", workshop.write("b.obj", square(0.4)), Vector3d(1, 0, 0)),
      object("front", workshop.write("f.obj", square(0.1)), Vector3d(0.5, 0, 0.1), false)};
  const std::vector<VisibleEdge> edges = edgesOf(scene);
  // Outline from 53.5 to 105.5 and from 33.5 to 85.5 px; 66.5 to 92.5 of the top is hidden.
  ASSERT_EQ(edges.size(), 5u);
  std::set<int> ids;
  std::vector<double> top_ends;
  for (const VisibleEdge& edge : edges) {
    EXPECT_EQ(edge.kind, EdgeKind::kBoundary);
    EXPECT_EQ(edge.object, 0);
    ids.insert(edge.edge);
    for (const Vector2d& u : edge.line_px) {
      const double off = std::min({std::abs(u.x() - 53.5), std::abs(u.x() - 105.5),
                                   std::abs(u.y() - 33.5), std::abs(u.y() - 85.5)});
      EXPECT_LT(off, 1e-4);
    }
    const Vector2d &a = edge.line_px.front(), &b = edge.line_px.back();
    if (std::abs(a.y() - 33.5) < 1e-3 && std::abs(b.y() - 33.5) < 1e-3)
      top_ends.insert(top_ends.end(), {a.x(), b.x()});
    else
      EXPECT_NEAR((a - b).norm(), 52, 1e-4);
  }
  EXPECT_EQ(ids.size(), 4u);
  std::sort(top_ends.begin(), top_ends.end());
  ASSERT_EQ(top_ends.size(), 4u);
  EXPECT_NEAR(top_ends[0], 53.5, 1e-4);
  EXPECT_NEAR(top_ends[1], 66.5, 2e-3);
  EXPECT_NEAR(top_ends[2], 92.5, 2e-3);
  EXPECT_NEAR(top_ends[3], 105.5, 1e-4);
  scene.objects[1].T_world_object.translation = Vector3d(0.5, 5, 0);
  EXPECT_EQ(edgesOf(scene).size(), 4u);
  scene.objects[0].T_world_object.translation = Vector3d(-1, 0, 0);  // behind the camera
  EXPECT_TRUE(edgesOf(scene).empty());
}

// An upright prism of 24 sides seen from its middle: two of its flat folds are its outline.
std::string prism() {
  std::string text;
  for (int k = 0; k < 24; ++k) {
    const double a = 2 * M_PI * (k + 0.5) / 24;
    for (const double z : {-0.15, 0.15})
      text += "v " + std::to_string(0.1 * std::cos(a)) + " " + std::to_string(0.1 * std::sin(a)) +
              " " + std::to_string(z) + "\n";
  }
  std::string top = "f", bottom = "f";
  for (int k = 0; k < 24; ++k) {
    const int a = 2 * k + 1, b = 2 * ((k + 1) % 24) + 1;
    text += "f " + std::to_string(a) + " " + std::to_string(b) + " " + std::to_string(b + 1) + " " +
            std::to_string(a + 1) + "\n";
    top += " " + std::to_string(a + 1);
    bottom += " " + std::to_string(2 * (24 - k) - 1);
  }
  return text + top + "\n" + bottom + "\n";
}

TEST(VisibleEdges, SilhouetteOfARoundThing) {
  const Workshop workshop("edge_round");
  Scene scene = plainScene();
  scene.objects = {object("can", workshop.write("c.obj", prism()), Vector3d(1, 0, 0))};
  std::vector<double> columns;
  int rims = 0;
  for (const VisibleEdge& edge : edgesOf(scene)) {
    if (edge.kind == EdgeKind::kSharp) ++rims;
    if (edge.kind != EdgeKind::kSmooth) continue;
    columns.push_back(edge.line_px.front().x());
    EXPECT_NEAR(edge.line_px.front().x(), edge.line_px.back().x(), 1e-4);
    EXPECT_NEAR((edge.line_px.front() - edge.line_px.back()).norm(), 39, 1);
  }
  std::sort(columns.begin(), columns.end());
  ASSERT_EQ(columns.size(), 2u);
  EXPECT_NEAR(columns[0], 79.5 - 13, 0.3);
  EXPECT_NEAR(columns[1], 79.5 + 13, 0.3);
  EXPECT_NEAR(columns[0] + columns[1], 159, 1e-3);
  EXPECT_GE(rims, 2 * 11);  // the near halves of both rims
  EXPECT_LE(rims, 2 * 13);
}

// In the model of the picture: distorted, and with a rolling shutter.
TEST(VisibleEdges, LieWhereTheCameraSeesThem) {
  const Workshop workshop("edge_model");
  for (const double row_time_s : {0.0, 2e-4}) {
    Scene scene = plainScene();
    scene.camera = {CameraModel::kRadTan,           160, 120, 130, 131, 78.3, 60.1,
                    {-0.21, 0.045, 0.0006, -0.0004}};
    scene.row_time_s = row_time_s;
    scene.path = makeSplinePath({{-1, lookAt({0, 1.5, 0}, {1, 0.9, 0})},
                                 {0, lookAt({0, 0, 0}, {1, 0, 0})},
                                 {1, lookAt({0, -1.5, 0}, {1, -0.9, 0})}});
    scene.objects = {object("wall", workshop.write("w.obj", square(0.6)), Vector3d(1, 0.02, 0.01))};
    const Camera camera(scene.camera);
    const std::vector<VisibleEdge> edges = edgesOf(scene);
    EXPECT_EQ(edges.size(), 4u);
    for (const VisibleEdge& edge : edges) {
      EXPECT_GT(edge.line_px.size(), 10u);
      for (const Vector2d& u : edge.line_px) {
        // The ray of this pixel, at the time of its row, meets the outline.
        const SE3 T = scene.path->pose(row_time_s * (u.y() - 59.5));
        const Vector3d direction = T.rotation * *camera.unproject(u);
        const Vector3d p = T.translation + direction * ((1 - T.translation.x()) / direction.x());
        const double off = std::max(std::abs(p.y() - 0.02), std::abs(p.z() - 0.01)) - 0.3;
        EXPECT_NEAR(off, 0, 1e-6);
      }
    }
    EXPECT_EQ(edgesOf(scene, 2).size(), edges.size());
  }
}

TEST(VisibleEdges, EndAtTheImage) {
  const Workshop workshop("edge_border");
  Scene scene = plainScene();
  scene.objects = {object("wall", workshop.write("w.obj", square(0.6)), Vector3d(1, 0.6, 0))};
  const std::vector<VisibleEdge> edges = edgesOf(scene);  // its left side is out of the image
  ASSERT_EQ(edges.size(), 3u);
  double left = 1e9;
  for (const VisibleEdge& edge : edges)
    for (const Vector2d& u : edge.line_px) left = std::min(left, u.x());
  EXPECT_NEAR(left, -0.5, 2e-3);
}

}  // namespace
}  // namespace diorama
