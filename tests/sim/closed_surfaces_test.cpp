#include "sim/closed_surfaces.h"

#include <gtest/gtest.h>

#include <array>
#include <initializer_list>

#include "sim/render_scene.h"

namespace diorama {
namespace {

// Each face has corners of its own, as where texture coordinates differ.
void addFace(RenderScene& scene, const std::array<Vector3f, 4>& corners) {
  const auto first = static_cast<uint32_t>(scene.corners.size());
  scene.corners.insert(scene.corners.end(), corners.begin(), corners.end());
  for (const uint32_t k : {0u, 1u, 2u, 0u, 2u, 3u}) scene.indices.push_back(first + k);
  scene.triangles.resize(scene.triangles.size() + 2);
}

// A box from -half to half, its upper side turned by a number of quarters of a turn; faces look
// outwards, or inwards.
RenderScene box(int faces, int quarters = 0, bool inwards = false) {
  const auto corner = [&](int k, bool upper) {
    k += upper ? quarters : 0;
    return Vector3f(k % 4 == 0 || k % 4 == 3 ? -0.5f : 0.5f, k % 4 < 2 ? -0.5f : 0.5f,
                    upper ? 0.5f : -0.5f);
  };
  RenderScene scene;
  const auto add = [&](std::array<Vector3f, 4> face) {
    if (inwards) std::swap(face[1], face[3]);
    if (faces-- > 0) addFace(scene, face);
  };
  for (int k = 0; k < 4; ++k)
    add({corner(k, false), corner(k + 1, false), corner(k + 1, true), corner(k, true)});
  add({corner(0, true), corner(1, true), corner(2, true), corner(3, true)});
  add({corner(3, false), corner(2, false), corner(1, false), corner(0, false)});
  scene.corners.emplace_back(0, 0, 0);  // spare
  return scene;
}

bool isClosed(const RenderScene& scene) {
  const ClosedSurfaces closed = findClosedSurfaces(scene);
  EXPECT_EQ(closed.of_triangle.size(), scene.triangles.size());
  for (const int surface : closed.of_triangle)
    if (surface == ClosedSurfaces::kOpen) return false;
  return true;
}

TEST(ClosedSurfaces, ABoxHasAnInside) {
  const RenderScene scene = box(6);
  ASSERT_TRUE(isClosed(scene));
  const ClosedSurfaces closed = findClosedSurfaces(scene);
  ASSERT_EQ(closed.boxes.size(), 1u);
  EXPECT_EQ(closed.boxes[0].min(), Vector3f(-0.5f, -0.5f, -0.5f));
  EXPECT_EQ(closed.boxes[0].max(), Vector3f(0.5f, 0.5f, 0.5f));
}

TEST(ClosedSurfaces, ABoxWithoutALidHasNone) { EXPECT_FALSE(isClosed(box(5))); }

TEST(ClosedSurfaces, ARoomSeenFromWithinHasNone) { EXPECT_FALSE(isClosed(box(6, 0, true))); }

// Turned by half, the upper part of the box is inside out.
TEST(ClosedSurfaces, ATwistedBoxHasNone) { EXPECT_FALSE(isClosed(box(6, 2))); }

TEST(ClosedSurfaces, InstancesThatTouchAreApart) {
  RenderScene scene = box(6);
  scene.corners.pop_back();
  const RenderScene other = box(6);
  for (size_t k = 0; k < other.indices.size(); k += 6) {
    std::array<Vector3f, 4> face;
    for (size_t i = 0; i < 4; ++i)
      face[i] = other.corners[other.indices[k] + i] + Vector3f::UnitX();
    addFace(scene, face);
    for (size_t i = 1; i <= 2; ++i) scene.triangles[scene.triangles.size() - i].instance = 1;
  }
  scene.corners.emplace_back(0, 0, 0);
  EXPECT_TRUE(isClosed(scene));
  EXPECT_EQ(findClosedSurfaces(scene).boxes.size(), 2u);
}

TEST(ClosedSurfaces, TrianglesWithoutAnAreaDoNoHarm) {
  RenderScene scene = box(6);
  for (const uint32_t k : {0u, 1u, 1u}) scene.indices.push_back(k);
  scene.triangles.emplace_back();
  EXPECT_TRUE(isClosed(scene));
}

TEST(ClosedSurfaces, NothingIsNothing) {
  RenderScene scene;
  scene.corners.emplace_back(0, 0, 0);
  EXPECT_TRUE(findClosedSurfaces(scene).of_triangle.empty());
}

}  // namespace
}  // namespace diorama
