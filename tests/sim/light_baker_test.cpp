#include "sim/light_baker.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <numbers>

#include "tests/sim/scene_support.h"

namespace diorama {
namespace {

using test::object;
using test::plainScene;
using test::square;
using test::Workshop;

// Light at the samples of a triangle nearest to a point in its plane.
float lightNear(const RenderScene& scene, const Vector3f& p) {
  float best = 1e9f, value = -1;
  for (uint32_t k = 0; k < scene.triangles.size(); ++k) {
    const int r = scene.triangles[k].light_resolution;
    auto s = static_cast<size_t>(scene.triangles[k].light_offset);
    for (int j = 0; j <= r; ++j)
      for (int i = 0; i + j <= r; ++i, ++s) {
        const float u = static_cast<float>(i) / static_cast<float>(r),
                    v = static_cast<float>(j) / static_cast<float>(r);
        const Vector3f q =
            (1 - u - v) * scene.corner(k, 0) + u * scene.corner(k, 1) + v * scene.corner(k, 2);
        if ((q - p).norm() >= best) continue;
        best = (q - p).norm();
        const auto red = static_cast<float>(scene.light.samples[s] & 2047);
        value = red * red / (2047.f * 2047.f) * scene.light.max;
      }
  }
  return value;
}

// A wall 2 m before a small lamp at the origin that shines along +x.
Scene lampAndWall(const Workshop& workshop) {
  Scene scene = plainScene();
  scene.lights = {{Vector3d::Zero(), Vector3d(0, 0.05, 0), Vector3d(0, 0, 0.05), Vector3d::Ones()}};
  workshop.write("black.mtl", "newmtl paint\nKd 0 0 0\nKs 0 0 0\n");
  scene.objects = {
      object("wall", workshop.write("w.obj", square(6, "mtllib black.mtl\n")), Vector3d(2, 0, 0))};
  return scene;
}

RenderScene baked(const Scene& scene, int threads = 1) {
  RenderScene result = makeRenderScene(scene);
  WorkerPool pool(threads);
  bakeLight(result, {.spacing_m = 0.03, .max_samples = 100000, .last_bounce_rays = 32}, pool);
  return result;
}

TEST(LightBaker, AreaLightFollowsCosinesAndInverseSquare) {
  const Workshop workshop("inverse_square");
  const RenderScene scene = baked(lampAndWall(workshop));
  for (const double y : {0.0, 1.0, 2.0}) {
    const double r2 = 4 + y * y, cosine = 2 / std::sqrt(r2);
    const double expected = 0.01 * cosine * cosine / r2 / std::numbers::pi;  // area 0.1 x 0.1
    EXPECT_NEAR(
        static_cast<double>(lightNear(scene, Vector3f(2, static_cast<float>(y), 0))) / expected, 1,
        0.04)
        << y;
  }
}

TEST(LightBaker, ShadowHasUmbraAndPenumbra) {
  // A square of 0.2 m half way: umbra of half width 0.15, penumbra to 0.25.
  const Workshop workshop("shadow");
  Scene scene = lampAndWall(workshop);
  const double open = static_cast<double>(lightNear(baked(scene), Vector3f(2, 0, 0)));
  scene.objects.push_back(object(
      "board", workshop.write("b.obj", square(0.2, "mtllib black.mtl\n")), Vector3d(1, 0, 0)));
  const RenderScene shadowed = baked(scene);
  const auto share = [&](float y) {
    return static_cast<double>(lightNear(shadowed, Vector3f(2, y, 0))) / open;
  };
  EXPECT_LT(share(0.f), 0.01);
  EXPECT_LT(share(0.11f), 0.02);
  EXPECT_NEAR(share(0.2f), 0.5, 0.2);
  EXPECT_GT(share(0.3f), 0.9);
}

TEST(LightBaker, ClosedBoxKeepsItsEnergy) {
  // In an open sky of radiance 1 a convex body receives 1 everywhere.
  const Workshop workshop("sky");
  Scene scene = plainScene();
  scene.ambient = 1;
  scene.objects = {object("wall", workshop.write("w.obj", square(1)), Vector3d(2, 0, 0))};
  const RenderScene lit = baked(scene);
  EXPECT_NEAR(lightNear(lit, Vector3f(2, 0, 0)), 1, 0.01);
}

TEST(LightBaker, ThreadsDoNotChangeTheLight) {
  const Workshop workshop("bake_threads");
  Scene scene = lampAndWall(workshop);
  scene.objects.push_back(object("board", workshop.write("b.obj", square(0.2)), Vector3d(1, 0, 0)));
  EXPECT_EQ(baked(scene, 1).light.samples, baked(scene, 3).light.samples);
}

TEST(LightBaker, CacheGivesTheSameAndSurvivesDamage) {
  const Workshop workshop("cache");
  const Scene scene = lampAndWall(workshop);
  WorkerPool pool(2);
  const LightBakerOptions options{.spacing_m = 0.05, .max_samples = 50000, .last_bounce_rays = 32};
  const auto run = [&] {
    RenderScene result = makeRenderScene(scene);
    loadOrBakeLight(result, options, pool);
    return result.light;
  };
  const LightMap first = run();
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(workshop.cache() / "light"))
    files.push_back(entry.path());
  ASSERT_EQ(files.size(), 1u);
  const std::string good = readFile(files[0]);

  const auto expectSame = [&](const char* what) {
    const LightMap again = run();
    EXPECT_EQ(again.samples, first.samples) << what;
    EXPECT_EQ(again.max, first.max) << what;
    EXPECT_EQ(again.typical, first.typical) << what;
    EXPECT_EQ(readFile(files[0]), good) << what;
  };
  expectSame("hit");
  writeFileAtomically(files[0], good.substr(0, good.size() / 2));
  expectSame("cut off");
  std::string damaged = good;
  damaged[good.size() - 5] = static_cast<char>(damaged[good.size() - 5] ^ 1);
  writeFileAtomically(files[0], damaged);
  expectSame("one bit off");
  writeFileAtomically(files[0], "");
  expectSame("empty");
}

}  // namespace
}  // namespace diorama
