// Occluders that are scripted by what they hide.
#include "sim/occlusion.h"

#include <gmock/gmock.h>

#include <cmath>

#include "sim/mesh_import.h"
#include "sim/occlusion_view.h"
#include "small_scene.h"

namespace diorama {
namespace {

using testing::errorLine;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class Occlusion : public testing::SmallScene {
 protected:
  void SetUp() override {
    SmallScene::SetUp();
    ::setenv("DIORAMA_CACHE", (folder_ / "cache").c_str(), 1);
    writeFileAtomically(
        folder_ / "scene.yaml",
        R"(camera: {model: radtan, width: 480, height: 360, fx: 390, fy: 390, cx: 239.5, cy: 179.5, distortion: [-0.1, 0.02, 0, 0], rate_hz: 20}
duration_s: 5
path: {type: orbit, center: [0, 0, 0.12], radius_m: 0.7, height_m: 0.2, rate_rad_s: 0.2, shake: {amplitude_m: 0.002, amplitude_rad: 0.004}}
objects:
  - {name: box, model: box.obj, T_world_object: {position: [0, 0, 0]}}
)");
  }
  Scene load(const std::string& occlude, const std::vector<std::string>& changes = {}) const {
    std::vector<YamlOverride> overrides{parseOverride("occlude=" + occlude)};
    for (const std::string& change : changes) overrides.push_back(parseOverride(change));
    return loadScene(folder_ / "scene.yaml", overrides);
  }
  static std::string request(const std::string& occluder, const std::string& fractions,
                             const std::string& more = "") {
    return "{object: box, occluder: " + occluder + ", visible_fraction: " + fractions + more + "}";
  }
  // What is seen of the first object at every frame, all others included.
  static std::vector<double> visibleFractions(const Scene& scene) {
    std::vector<Mesh> meshes;
    for (const SceneObject& object : scene.objects) meshes.push_back(importMesh(object.mesh));
    const ObjectViewer viewer(scene, 0, meshes, nullptr);
    std::vector<double> fractions;
    for (int k = 0; k < scene.frameCount(); ++k) fractions.push_back(viewer.look(k).fraction());
    return fractions;
  }
};

TEST_F(Occlusion, FractionsAreMetByEveryOccluder) {
  for (const char* occluder : {"hand", "board", "pole", "box"}) {
    const Scene scene =
        load(request(occluder, "[[1, 1], [2, 0.3], [2.5, 0], [3, 0], [3.6, 0.7], [4, 1]]"));
    ASSERT_EQ(scene.objects.size(), 2u);
    EXPECT_THAT(scene.objects[1].name, StartsWith(occluder));
    const std::vector<double> fractions = visibleFractions(scene);
    const auto at = [&](double t) { return fractions[static_cast<size_t>(std::lround(t * 20))]; };
    for (double t = 1; t <= 2; t += 0.05)
      EXPECT_NEAR(at(t), 1 - 0.7 * (t - 1), 0.02) << occluder << t;
    for (double t = 2; t <= 2.5; t += 0.05)
      EXPECT_NEAR(at(t), 0.6 * (2.5 - t), 0.02) << occluder << t;
    for (double t = 2.5; t <= 3; t += 0.05) EXPECT_LE(at(t), 0.02) << occluder << t;
    for (double t = 3; t <= 3.6; t += 0.05)
      EXPECT_NEAR(at(t), 0.7 * (t - 3) / 0.6, 0.02) << occluder << t;
    for (double t : {0.0, 0.5, 0.95, 4.1, 4.9}) EXPECT_GE(at(t), 0.998) << occluder << t;
  }
}

TEST_F(Occlusion, TheOccluderComesGoesAndMovesSmoothly) {
  const Scene scene = load(request("hand", "[[2, 1], [2.5, 0.2], [3.3, 1]]"));
  const MotionPath& path = *scene.objects[1].path;
  // Away it is behind the camera.
  for (double t : {0.0, 1.0, 4.3, 4.9})
    EXPECT_LT((scene.path->pose(t).inverse() * path.pose(t).translation).z(), -1) << t;
  double fastest = 0;
  for (double t = 1.3; t < 4; t += 0.01)
    fastest = std::max(fastest,
                       (path.pose(t + 0.01).translation - path.pose(t).translation).norm() / 0.01);
  EXPECT_GT(fastest, 0.1);
  EXPECT_LT(fastest, 2.5) << "m/s";
}

TEST_F(Occlusion, SeveralOccludersSeeOneAnother) {
  const Scene scene =
      load("[" + request("board", "[[1, 0.6], [3, 0.6]]", ", from: left") + ", " +
           request("pole", "[[1.5, 0.6], [2, 0.4], [2.5, 0.6]]", ", name: rod") + "]");
  ASSERT_EQ(scene.objects.size(), 3u);
  EXPECT_EQ(scene.objects[2].name, "rod");
  EXPECT_NEAR(visibleFractions(scene)[40], 0.4, 0.02);
  EXPECT_NEAR(visibleFractions(scene)[24], 0.6, 0.02);
}

TEST_F(Occlusion, WaysAreKeptAndTheSameWhenSolvedAgain) {
  const std::string text = request("board", "[[1, 1], [1.5, 0.5], [2, 1]]");
  const std::string first = describeScene(load(text));
  const auto cache = folder_ / "cache/occlusion";
  const auto file = std::filesystem::directory_iterator(cache)->path();
  EXPECT_EQ(describeScene(load(text)), first);
  writeFileAtomically(file, "0.3 0 12 nan end");
  EXPECT_EQ(describeScene(load(text)), first) << "a broken file is not believed";
  std::filesystem::remove_all(cache);
  EXPECT_EQ(describeScene(load(text)), first);
  load(text, {"path.radius_m=0.71"});
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(cache), {}), 2);
}

TEST_F(Occlusion, WhatCannotBeMetIsOneLineWithTheTime) {
  const auto line = [&](const std::string& occlude, const std::vector<std::string>& changes = {}) {
    return errorLine([&] { load(occlude, changes); }, kExitBadData);
  };
  // A second box stands before the first.
  const std::string wall =
      "objects.1={name: wall, model: box.obj, T_world_object: {position: [0.15, 0, 0]}}";
  writeFileAtomically(folder_ / "scene.yaml", readFile(folder_ / "scene.yaml") + "  - {}\n");
  EXPECT_THAT(line(request("hand", "[[0.5, 1], [1, 0]]"), {wall}), HasSubstr("at 0.50 s only 0."));
  EXPECT_THAT(
      line(request("hand", "[[2, 1], [2.5, 0]]", ", distance_m: 0.69"),
           {"objects.1={name: far, model: box.obj, T_world_object: {position: [0, 0, 9]}}"}),
      HasSubstr("too near"));
  EXPECT_THAT(
      line(request("pole", "[[7, 1], [8, 0]]"),
           {"objects.1={name: far, model: box.obj, T_world_object: {position: [0, 0, 9]}}"}),
      HasSubstr("no frame"));
}

TEST_F(Occlusion, BadRequestsAreToldWhereTheyStand) {
  for (const char* occlude :
       {"3", "{object: box}", "{object: bocks, occluder: hand, visible_fraction: [[0, 1]]}",
        "{object: box, occluder: foot, visible_fraction: [[0, 1]]}",
        "{object: box, occluder: hand, visible_fraction: []}",
        "{object: box, occluder: hand, visible_fraction: [[0, 1, 2]]}",
        "{object: box, occluder: hand, visible_fraction: [[0, 1.5]]}",
        "{object: box, occluder: hand, visible_fraction: [[1, 1], [0, 1]]}",
        "{object: box, occluder: pole, visible_fraction: [[0, 1]], from: below}",
        "{object: box, occluder: hand, visible_fraction: [[0, 1]], distance_m: 0}",
        "{object: box, occluder: hand, visible_fraction: [[0, 1]], name: box}"})
    EXPECT_THAT(errorLine([&] { load(occlude); }, kExitBadData), HasSubstr("occlude")) << occlude;
}

}  // namespace
}  // namespace diorama
