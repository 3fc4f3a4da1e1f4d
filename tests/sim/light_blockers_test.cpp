#include "sim/light_blockers.h"

#include <gtest/gtest.h>

#include <random>

#include "sim/point_groups.h"

namespace diorama {
namespace {

// Loose triangles, as an object's scene holds them.
RenderScene looseTriangles(int count, std::mt19937& random) {
  std::uniform_real_distribution<float> place(-0.3f, 0.3f), side(-0.05f, 0.05f);
  RenderScene scene;
  for (int k = 0; k < count; ++k) {
    const Vector3f middle(place(random), 0.2f * place(random), place(random));
    for (int c = 0; c < 3; ++c) {
      scene.indices.push_back(static_cast<uint32_t>(scene.corners.size()));
      scene.corners.push_back(middle + Vector3f(side(random), side(random), side(random)));
    }
  }
  scene.triangles.resize(static_cast<size_t>(count));
  scene.corners.push_back(Vector3f::Zero());
  return scene;
}

RectangleLight ceilingLight() {
  RectangleLight light;
  light.center = {0.2f, 0.1f, 2};
  light.axis_u = Vector3f::UnitX();
  light.axis_v = Vector3f::UnitY();
  light.normal = -Vector3f::UnitZ();
  light.half_u = 0.3f;
  light.half_v = 0.1f;
  return light;
}

TEST(LightBlockers, MissNothingThatStandsBetween) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(-1, 1), share(0.02f, 0.98f);
  const RectangleLight light = ceilingLight();
  for (const int count : {1, 5, 16, 200}) {
    const RenderScene scene = looseTriangles(count, random);
    const LightBlockers blockers(scene);
    for (int k = 0; k < 2000; ++k) {
      // From a place on the light through one on the object to a point below.
      const Vector3f from = light.center + unit(random) * light.half_u * light.axis_u +
                            unit(random) * light.half_v * light.axis_v;
      const Vector3f through = scene.corners[random() % (scene.corners.size() - 1)];
      const Vector3f point = from + (through - from) / share(random);
      EXPECT_TRUE(blockers.mayHide(light, point, 1e-5f));
      const Vector3f beside = point + 0.1f * Vector3f(unit(random), unit(random), unit(random));
      EXPECT_TRUE(blockers.mayHide(light, beside, (beside - point).norm() + 1e-5f));
    }
  }
}

TEST(LightBlockers, LookIntoTheGapsOfAnObject) {
  std::mt19937 random(2);
  RenderScene scene = looseTriangles(64, random);
  for (size_t k = 0; k < scene.corners.size(); ++k) {  // two halves, far apart
    scene.corners[k] *= 0.3f;
    scene.corners[k].x() += k / 3 % 2 == 0 ? -1.f : 1.f;
  }
  RectangleLight light = ceilingLight();
  light.half_u = light.half_v = 0.05f;
  light.center = {0, 0, 2};
  const LightBlockers blockers(scene);
  EXPECT_FALSE(blockers.mayHide(light, {0, 0, -1}, 0.01f));
  EXPECT_FALSE(blockers.mayHide(light, {0, 0, 5}, 0.01f));
  EXPECT_TRUE(blockers.mayHide(light, {-1.5f, 0, -1}, 0.01f));
}

TEST(LightBlockers, NothingHidesNothing) {
  RenderScene scene;
  EXPECT_FALSE(LightBlockers(scene).mayHide(ceilingLight(), {0, 0, 0}, 0.1f));
}

TEST(PointGroups, HoldEveryPointOnceInTheirSpheres) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> place(-2, 2);
  for (const size_t count : {size_t{0}, size_t{1}, size_t{64}, size_t{1000}}) {
    std::vector<Vector3f> points(count);
    for (Vector3f& p : points) p = {place(random), place(random), 0};
    const PointGroups groups = groupPoints(points);
    std::vector<int> seen(count, 0);
    for (const PointGroup& group : groups.groups)
      for (uint32_t k = group.first; k < group.end; ++k) {
        ++seen[groups.order[k]];
        EXPECT_LE((points[groups.order[k]] - group.center).norm(), group.radius_m * 1.0001f);
      }
    EXPECT_EQ(seen, std::vector<int>(count, 1));
  }
}

}  // namespace
}  // namespace diorama
