// What the scenes promise that only their frames, or the ways of their occluders, can show.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "sim/mesh_import.h"
#include "sim/occlusion_reader.h"
#include "sim/occlusion_view.h"
#include "sim/simulator.h"
#include "sim/worker_pool.h"

namespace diorama {
namespace {

std::filesystem::path fileOf(const std::string& name) {
  ::setenv("DIORAMA_DATA", DIORAMA_SOURCE_DIR, 1);
  return std::string(DIORAMA_SOURCE_DIR "/scenes/") + name + ".yaml";
}

// The visible fraction of an object at every frame.
std::vector<double> visibleFractions(const Scene& scene, size_t object) {
  std::vector<Mesh> meshes;
  for (const SceneObject& o : scene.objects)
    meshes.push_back(importMesh(o.mesh, {o.scale, o.y_up}));
  const Mesh environment = importMesh(scene.environment_mesh);
  const ObjectViewer viewer(scene, object, meshes, &environment);
  std::vector<double> fractions(static_cast<size_t>(scene.frameCount()));
  WorkerPool pool(0);
  pool.run(scene.frameCount(),
           [&](int k) { fractions[static_cast<size_t>(k)] = viewer.look(k).fraction(); });
  return fractions;
}

double requested(const std::vector<VisibleFraction>& knots, double time_s) {
  size_t k = 1;
  while (k + 1 < knots.size() && time_s > knots[k].time_s) ++k;
  const VisibleFraction &a = knots[k - 1], &b = knots[k];
  return a.fraction + (b.fraction - a.fraction) * (time_s - a.time_s) / (b.time_s - a.time_s);
}

class OccludedScene : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Scenes, OccludedScene,
                         ::testing::Values("orange_juice_occluded", "pasta_box_occluded",
                                           "detergent_occluded", "stress/full_occlusion"));

TEST_P(OccludedScene, ShowsOfTheObjectWhatItAsksFor) {
  const Scene scene = loadScene(fileOf(GetParam()));
  const auto requests =
      readOcclusions(*loadYaml(fileOf(GetParam())).find("occlude"),
                     loadScene(fileOf(GetParam()), {parseOverride("occlude=[]")}));
  const std::vector<double> fractions = visibleFractions(scene, requests[0].object);
  double worst = 0, halved_s = 0, hidden_s = 0;
  for (int k = 0; k < scene.frameCount(); ++k) {
    const double t = scene.time_s(k), fraction = fractions[static_cast<size_t>(k)];
    for (const OcclusionRequest& request : requests) {
      const auto& knots = request.visible_fraction;
      if (t < knots.front().time_s || t > knots.back().time_s) continue;
      const double error = std::abs(fraction - requested(knots, t));
      EXPECT_LE(error, kOcclusionTolerance) << request.name << " at " << t << " s";
      worst = std::max(worst, error);
      halved_s += fraction < 0.5 ? 1 / scene.rate_hz : 0;
      hidden_s += fraction < kOcclusionTolerance ? 1 / scene.rate_hz : 0;
    }
  }
  std::printf("%s: off by at most %.4f; below half for %.1f s, hidden for %.1f s\n", GetParam(),
              worst, halved_s, hidden_s);
  EXPECT_GE(hidden_s, 2);
  EXPECT_GE(halved_s, 2);
}

// The view that ways are solved with is that of the truth.
TEST(OccludedSceneTruth, IsWhatTheSolverSaw) {
  const Scene scene = loadScene(fileOf("orange_juice_occluded"));
  const std::vector<double> fractions = visibleFractions(scene, 0);
  Simulator simulator(scene, {RenderQuality::kDraft});
  for (int k : {0, 150, 170, 330, 540, 640, 840}) {
    const std::optional<double> truth = simulator.read(k).truth->objects[0].visibleFraction();
    ASSERT_TRUE(truth.has_value());
    EXPECT_NEAR(*truth, fractions[static_cast<size_t>(k)], 0.002) << "frame " << k;
  }
}

// The same frame with two seeds differs by nothing but the noise.
TEST(SceneNoise, IsAtLeastTwoGreyLevelsAtMidGrey) {
  for (const char* name : {"orange_juice", "pasta_box", "detergent"}) {
    std::vector<Image<uint8_t>> pictures;
    for (uint64_t seed : {1u, 2u}) {
      Scene scene = loadScene(fileOf(name));
      scene.seed = seed;
      pictures.push_back(Simulator(scene, {RenderQuality::kDraft}).read(0).frame.gray);
    }
    double sum = 0;
    int count = 0;
    for (size_t i = 0; i < pictures[0].pixels.size(); ++i) {
      const double a = pictures[0].pixels[i], b = pictures[1].pixels[i];
      if (std::abs((a + b) / 2 - 127.5) > 10) continue;
      sum += (a - b) * (a - b) / 2;
      ++count;
    }
    ASSERT_GT(count, 1000);
    const double levels = std::sqrt(sum / count);
    std::printf("%s: %.2f grey levels of noise at mid-grey\n", name, levels);
    EXPECT_GE(levels, 2);
    EXPECT_LE(levels, 4);
  }
}

}  // namespace
}  // namespace diorama
