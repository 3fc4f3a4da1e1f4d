#include "tracker/edge_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "tests/tracker/box_scene.h"

namespace diorama {
namespace {

int countKind(const EdgeModel& model, EdgeKind kind) {
  int n = 0;
  for (const ModelEdge& e : model.edges) n += e.kind == kind;
  return n;
}

// Two squares of side 1 that meet in an edge, the second one turned up by `fold_rad`.
Mesh foldedSheet(double fold_rad, bool mixed_winding = false) {
  Mesh mesh;
  const float c = static_cast<float>(std::cos(fold_rad)),
              s = static_cast<float>(std::sin(fold_rad));
  mesh.positions = {{-1, 0, 0}, {0, 0, 0}, {0, 1, 0}, {-1, 1, 0}, {c, 0, s}, {c, 1, s}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {1, 4, 5}, {1, 5, 2}};
  if (mixed_winding)
    for (size_t i = 2; i < 4; ++i) std::swap(mesh.triangles[i][0], mesh.triangles[i][1]);
  return mesh;
}

TEST(EdgeModel, BoxWithRepeatedVerticesHasTwelveSharpEdges) {
  const EdgeModel model = makeEdgeModel(test::boxMesh(), {});
  EXPECT_EQ(model.vertices.size(), 8u);
  EXPECT_EQ(model.edges.size(), 12u);
  EXPECT_EQ(countKind(model, EdgeKind::kSharp), 12);
  EXPECT_LT((model.centre_object - Vector3d(0, 0, 0.1)).norm(), 1e-7);
}

TEST(EdgeModel, VerticesWithinTheToleranceAreWelded) {
  Mesh mesh = test::boxMesh();
  for (size_t i = 0; i < mesh.positions.size(); ++i)
    mesh.positions[i] += Vector3f(1, -1, 1) * 2e-6f * static_cast<float>(i % 4);
  const EdgeModel model = makeEdgeModel(mesh, {});
  EXPECT_EQ(model.vertices.size(), 8u);
  EXPECT_EQ(countKind(model, EdgeKind::kSharp), 12);
}

TEST(EdgeModel, SharpIsAFoldOfMoreThan26Degrees) {
  const double degree = std::numbers::pi / 180;
  EXPECT_EQ(countKind(makeEdgeModel(foldedSheet(25 * degree), {}), EdgeKind::kSharp), 0);
  EXPECT_EQ(countKind(makeEdgeModel(foldedSheet(25 * degree), {}), EdgeKind::kSmooth), 1);
  EXPECT_EQ(countKind(makeEdgeModel(foldedSheet(27 * degree), {}), EdgeKind::kSharp), 1);
  EXPECT_EQ(countKind(makeEdgeModel(foldedSheet(27 * degree), {}), EdgeKind::kBoundary), 6);
  // Folded back nearly flat it is a knife's edge and shows from everywhere.
  EXPECT_EQ(countKind(makeEdgeModel(foldedSheet(170 * degree), {}), EdgeKind::kSharp), 1);
  EXPECT_EQ(makeEdgeModel(foldedSheet(0), {}).edges.size(), 6u);
}

TEST(EdgeModel, AFoldThatIsShadedSmoothlyIsRound) {
  const double degree = std::numbers::pi / 180;
  for (const double fold : {36 * degree, 80 * degree}) {
    Mesh mesh = foldedSheet(fold);
    const Vector3f left(0, 0, 1),
        right(-static_cast<float>(std::sin(fold)), 0, static_cast<float>(std::cos(fold)));
    const Vector3f between = (left + right).normalized();
    mesh.normals = {left, between, between, left, right, right};
    // Nobody shades a box's edge smoothly on purpose.
    EXPECT_EQ(countKind(makeEdgeModel(mesh, {}), EdgeKind::kSharp), fold > 1);
    EXPECT_EQ(countKind(makeEdgeModel(mesh, {}), EdgeKind::kSmooth), fold < 1);
    TrackerOptions never;
    never.rounded_edge_cosine = 1;
    EXPECT_EQ(countKind(makeEdgeModel(mesh, never), EdgeKind::kSharp), 1);
  }
}

TEST(EdgeModel, ABevelIsAnEdge) {
  // Between two faces of 1 m, one of a centimetre that turns half of the way.
  Mesh mesh;
  const float c = std::sqrt(0.5f), w = 0.01f * c;
  mesh.positions = {{-1, 0, 0}, {0, 0, 0},  {0, 1, 0},  {-1, 1, 0},
                    {w, 0, -w}, {w, 1, -w}, {w, 0, -1}, {w, 1, -1}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {1, 4, 5}, {1, 5, 2}, {4, 6, 7}, {4, 7, 5}};
  const Vector3f up(0, 0, 1), across(1, 0, 0), slanted(c, 0, c);
  const Vector3f first = (up + slanted).normalized(), second = (slanted + across).normalized();
  mesh.normals = {up, first, first, up, second, second, across, across};
  EXPECT_EQ(countKind(makeEdgeModel(mesh, {}), EdgeKind::kSharp), 2);
}

TEST(EdgeModel, WindingDoesNotMatter) {
  for (const double fold : {0.0, 0.2, 1.0}) {
    const EdgeModel same = makeEdgeModel(foldedSheet(fold), {});
    const EdgeModel mixed = makeEdgeModel(foldedSheet(fold, true), {});
    EXPECT_EQ(same.edges.size(), mixed.edges.size());
    EXPECT_EQ(countKind(same, EdgeKind::kSharp), countKind(mixed, EdgeKind::kSharp));
    for (const ModelEdge& e : mixed.edges) EXPECT_GT(e.n1.dot(e.n2), 0);
  }
}

TEST(EdgeModel, TwoSidedSheetsHaveNoInnerEdges) {
  Mesh mesh = foldedSheet(0);
  for (size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3i t = mesh.triangles[i];
    mesh.triangles.emplace_back(t[0], t[2], t[1]);
  }
  EXPECT_EQ(makeEdgeModel(mesh, {}).edges.size(), 6u);
}

TEST(EdgeModel, SamplesLieOnTheirEdges) {
  const EdgeModel model = makeEdgeModel(test::boxMesh(), {});
  for (size_t i = 0; i < model.samples.size(); ++i) {
    const EdgeSample& s = model.samples[i];
    const ModelEdge& e = model.edges[static_cast<size_t>(s.edge)];
    const Vector3d a = model.vertices[static_cast<size_t>(e.a)];
    EXPECT_LT((s.p - a).cross(s.direction).norm(), 1e-12);
    EXPECT_NEAR(s.direction.norm(), 1, 1e-12);
    EXPECT_GE(static_cast<int>(i), e.first_sample);
    EXPECT_LT(static_cast<int>(i), e.first_sample + e.sample_count);
  }
  const double length = 4 * (0.1 + 0.1 + 0.2);
  EXPECT_NEAR(static_cast<double>(model.samples.size()), length / model.sample_spacing, 12);
}

TEST(EdgeModel, NothingToSeeGivesNoEdges) {
  EXPECT_TRUE(makeEdgeModel({}, {}).edges.empty());
  Mesh line;
  line.positions = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  line.triangles = {{0, 1, 2}, {0, 0, 1}};
  EXPECT_TRUE(makeEdgeModel(line, {}).edges.empty());
  Mesh points;
  points.positions = {{1, 1, 1}, {1, 1, 1}};
  EXPECT_TRUE(makeEdgeModel(points, {}).edges.empty());
}

TEST(EdgeModel, TheContourIsWhereOneFaceLooksAwayOrIsMissing) {
  Mesh mesh = test::boxMesh();
  mesh.triangles.resize(mesh.triangles.size() - 2);  // one side is open
  const EdgeModel model = makeEdgeModel(mesh, {});
  std::vector<uint8_t> contour(3, 7);
  for (const Vector3d& eye :
       {Vector3d(0.3, 0.5, 0.9), Vector3d(-1, 0.1, 0.05), Vector3d(0, -2, 1)}) {
    findContour(model, eye, contour);
    ASSERT_EQ(contour.size(), model.edges.size());
    for (size_t i = 0; i < contour.size(); ++i) {
      const ModelEdge& e = model.edges[i];
      const Vector3d view = model.vertices[static_cast<size_t>(e.a)] - eye;
      EXPECT_EQ(contour[i] != 0,
                e.kind == EdgeKind::kBoundary || e.n1.dot(view) * e.n2.dot(view) <= 0);
    }
  }
}

}  // namespace
}  // namespace diorama
