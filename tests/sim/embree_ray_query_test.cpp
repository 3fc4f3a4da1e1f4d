#include "sim/embree_ray_query.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

namespace diorama {
namespace {

// Two parallel squares of side 2 at z = 0 and z = 1, facing +z.
Mesh squares() {
  Mesh mesh;
  for (const float z : {0.f, 1.f}) {
    const int k = static_cast<int>(mesh.positions.size());
    for (const auto& [x, y] :
         std::array<std::array<float, 2>, 4>{{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}})
      mesh.positions.emplace_back(x, y, z);
    mesh.triangles.emplace_back(k, k + 1, k + 2);
    mesh.triangles.emplace_back(k, k + 2, k + 3);
  }
  return mesh;
}

TEST(EmbreeRayQuery, ClosestHitIsExact) {
  const std::vector<Mesh> meshes = {squares()};
  const EmbreeRayQuery query(meshes);
  const auto hit = query.closestHit(0, Vector3d(0.1, 0.2, 3), Vector3d(0.01, 0, -0.5));
  ASSERT_TRUE(hit);
  EXPECT_LT((hit->p_object - Vector3d(0.14, 0.2, 1)).norm(), 1e-9);
  EXPECT_LT((hit->normal - Vector3d(0, 0, 1)).norm(), 1e-12);
  EXPECT_FALSE(query.closestHit(0, Vector3d(0, 0, 3), Vector3d(0, 0, 1)));
  EXPECT_FALSE(query.closestHit(0, Vector3d(5, 0, 3), Vector3d(0, 0, -1)));
}

TEST(EmbreeRayQuery, ManyDirectionsHitWhatEachOfThemHits) {
  const std::vector<Mesh> meshes = {squares()};
  const EmbreeRayQuery query(meshes);
  const Vector3d origin(0, 0, 3);
  std::vector<Vector3d> directions;
  for (int i = 0; i < 21; ++i)  // not a multiple of the packet's width; the outer ones miss
    directions.emplace_back(0.07 * i - 0.7, 0.1, i % 3 ? -1.0 : -2.0);
  const auto hits = query.closestHits(0, origin, directions);
  ASSERT_EQ(hits.size(), directions.size());
  for (size_t i = 0; i < hits.size(); ++i) {
    const Vector3d& d = directions[i];
    const Vector3d expected = origin + d * (2 / -d.z());
    ASSERT_EQ(hits[i].has_value(), std::abs(expected.x()) < 1) << i;
    if (hits[i]) {
      EXPECT_LT((hits[i]->p_object - expected).norm(), 1e-9) << i;
    }
  }
}

TEST(EmbreeRayQuery, SurfaceOfThePointItselfDoesNotCount) {
  const std::vector<Mesh> meshes = {squares()};
  const EmbreeRayQuery query(meshes);
  std::vector<Vector3d> points;
  std::vector<uint8_t> expected;
  for (int i = 0; i < 21; ++i) {  // not a multiple of the packet's width
    points.emplace_back(0.05 * i - 0.5, 0.3, i % 2 ? 1.0 : 0.0);
    expected.push_back(i % 2 ? 0 : 1);
  }
  points.emplace_back(3, 0, 0);  // beside both
  expected.push_back(0);
  std::vector<uint8_t> occluded(points.size(), 9);
  query.occluded(0, Vector3d(0, 0, 4), points, occluded);
  EXPECT_EQ(occluded, expected);
}

TEST(EmbreeRayQuery, ObjectsAreSeparate) {
  Mesh far = squares();
  for (Vector3f& p : far.positions) p.x() += 10;
  const std::vector<Mesh> meshes = {squares(), far};
  const EmbreeRayQuery query(meshes);
  EXPECT_TRUE(query.closestHit(0, Vector3d(0, 0, 3), Vector3d(0, 0, -1)));
  EXPECT_FALSE(query.closestHit(1, Vector3d(0, 0, 3), Vector3d(0, 0, -1)));
  EXPECT_TRUE(query.closestHit(1, Vector3d(10, 0, 3), Vector3d(0, 0, -1)));
}

}  // namespace
}  // namespace diorama
