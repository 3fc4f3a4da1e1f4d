#include "sim/scene.h"

#include <gmock/gmock.h>

#include <cmath>

#include "small_scene.h"

namespace diorama {
namespace {

using testing::errorLine;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class SceneFile : public testing::SmallScene {
 protected:
  Scene load(const std::vector<std::string>& changes = {}) const {
    std::vector<YamlOverride> overrides;
    for (const std::string& change : changes) overrides.push_back(parseOverride(change));
    return loadScene(folder_ / "scene.yaml", overrides);
  }
  // The scene with one piece of its text replaced.
  std::string errorWith(const std::string& old_text, const std::string& new_text,
                        ExitCode expected = kExitBadData) const {
    std::string text = yaml();
    const size_t at = text.find(old_text);
    EXPECT_NE(at, std::string::npos) << old_text;
    text.replace(at, old_text.size(), new_text);
    return errorLine([&] { parseScene(text, folder_ / "scene.yaml"); }, expected);
  }
};

TEST_F(SceneFile, EveryValueArrives) {
  const Scene scene = load();
  EXPECT_EQ(scene.name, "scene");
  EXPECT_EQ(scene.seed, 7u);
  EXPECT_EQ(scene.camera.model, CameraModel::kRadTan);
  EXPECT_EQ(scene.camera.fy, 51);
  EXPECT_EQ(scene.camera.distortion, (std::vector<double>{-0.1, 0.02, 0, 0}));
  EXPECT_EQ(scene.frameCount(), 6);
  EXPECT_EQ(scene.timestampNs(1), 33333000);
  EXPECT_EQ(scene.environment_mesh, folder_ / "room/plane.obj");
  ASSERT_EQ(scene.objects.size(), 3u);
  EXPECT_TRUE(scene.objects[0].tracked);
  EXPECT_EQ(scene.objects[0].symmetries.axis, Vector3d(0, 0, 1));
  EXPECT_LT((scene.objects[0].T_world_object.translation - Vector3d(0.1, 0.2, 0.5)).norm(), 1e-9);
  EXPECT_NEAR(logSO3(scene.objects[0].T_world_object.rotation).z(), 0.5, 1e-12);
  EXPECT_FALSE(scene.objects[1].tracked);
  EXPECT_EQ(scene.objects[1].T_world_object.translation, Vector3d(0, 1, 2));
  EXPECT_EQ(scene.objects[1].T_world_object.rotation.w(), 1);
  EXPECT_TRUE(scene.objects[2].y_up);
  ASSERT_EQ(scene.lights.size(), 1u);
  EXPECT_EQ(scene.lights[0].radiance, Vector3d(9, 9, 8));
  EXPECT_EQ(scene.ambient, 0.1);
  EXPECT_FALSE(scene.effects.noise);
  EXPECT_EQ(scene.odometry.drift_m_per_m, 0.03);
  EXPECT_LT((scene.T_world_camera(3).translation - Vector3d(0.9, 0.2, 0.8)).norm(), 1e-9);
}

// The box of 0.24 m stands on its y axis when up: y, half as large: it lies 0.05 m wide around 0.
TEST(Scenes, OfTheInstallationAreFoundFromAnyFolder) {
  EXPECT_EQ(loadScene("scenes/pasta_box.yaml").name, "pasta_box");
  EXPECT_THROW(loadScene("scenes/none.yaml"), MissingInputError);
}

TEST_F(SceneFile, OnPutsTheLowestVertexOnTheSurface) {
  const Scene scene = load();
  EXPECT_NEAR(scene.objects[2].T_world_object.translation.z(), 0.5 + 0.025, 1e-7);
}

TEST_F(SceneFile, OnAnotherObjectStopsWhereTheyTouch) {
  writeFileAtomically(folder_ / "slab.obj", testing::boxObj(0.3, 0.2, 0.05));
  const std::string slab = "objects.1={name: slab, model: slab.obj, on: desk, at: [-0.4, 0.2]}";
  const Scene scene = load(
      {slab, "objects.2={name: top, model: box.obj, on: slab, at: [-0.38, 0.22], yaw_rad: 0.7}"});
  EXPECT_NEAR(scene.objects[2].T_world_object.translation.z(), 0.5 + 0.05, 1e-5);
  const auto line = [&](const std::string& change) {
    return errorLine([&] { load({slab, change}); }, kExitBadData);
  };
  EXPECT_THAT(line("objects.2={name: top, model: box.obj, on: slab, at: [0.5, 0.5]}"),
              HasSubstr("`slab` is not below"));
  EXPECT_THAT(line("objects.2={name: top, model: box.obj, on: slap, at: [0, 0.5]}"),
              HasSubstr("did you mean `slab`?"));
}

TEST_F(SceneFile, ObjectsInOneAnotherAreToldByName) {
  // The first box stands at [0.1, 0.2], 0.1 m wide, turned by 0.5.
  const auto place = [](const std::string& at) {
    return "objects.1={name: other, model: box.obj, on: desk, yaw_rad: 0.5, at: " + at + "}";
  };
  const std::string line = errorLine([&] { load({place("[0.15, 0.2]")}); }, kExitBadData);
  EXPECT_THAT(line, HasSubstr("`other` and `box`"));
  EXPECT_THAT(line, StartsWith((folder_ / "scene.yaml").string() + ":"));
  load({place("[0.1879, 0.2481]")});  // face to face
  load({place("[0.3, 0.2]")});
  // Wholly inside, and on its way through.
  errorLine(
      [&] {
        load(
            {"objects.1={name: other, model: box.obj, scale: 0.3, T_world_object: {position: [0.1, "
             "0.2, 0.55]}}"});
      },
      kExitBadData);
  EXPECT_THAT(errorLine(
                  [&] {
                    load(
                        {"objects.1={name: other, model: box.obj, path: {type: dolly, from: [0.1, "
                         "0.4, 0.5], "
                         "to: [0.1, 0, 0.5], end_s: 0.2, yaw_rad: 0}}"});
                  },
                  kExitBadData),
              HasSubstr("overlap at 0.0"));
}

TEST_F(SceneFile, OverridesReplaceAndAddValues) {
  const Scene scene = load({"camera.exposure_s=0.02", "seed=11", "odometry.bias_m_per_m=0"});
  EXPECT_EQ(scene.exposure_s, 0.02);
  EXPECT_EQ(scene.seed, 11u);
  EXPECT_EQ(scene.odometry.bias_m_per_m, 0);
  EXPECT_EQ(errorLine([&] { load({"camera.exposure=1"}); }, kExitBadData).empty(), false);
}

TEST_F(SceneFile, DescriptionChangesWithEveryValueAndFile) {
  const std::string description = describeScene(load());
  EXPECT_EQ(description, describeScene(load()));
  for (const char* change :
       {"seed=8", "camera.fx=50.5", "camera.exposure_s=0.009", "effects.vignette=0.2",
        "odometry.noise_m=0.1", "objects.0.yaw_rad=0.6", "ambient=0.2", "duration_s=0.3",
        "path.keyframes.0.position=[1, 0, 0.81]", "objects.1.track=true",
        "objects.1={name: other, model: box.obj, path: {type: orbit, radius_m: 3}}",
        "environment=none"}) {
    std::vector<std::string> changes{change};
    if (std::string(change) == "environment=none") {
      for (const char* object : {"0", "2"})
        changes.push_back(std::string("objects.") + object + "={name: n" + object +
                          ", model: box.obj, T_world_object: {position: [0, 0, " + object + "]}}");
    }
    EXPECT_NE(description, describeScene(load(changes))) << change;
  }
  writeFileAtomically(folder_ / "box.mtl", "newmtl paper\nKd 0.8 0.7 0.5\n");
  EXPECT_NE(description, describeScene(load()));
}

TEST_F(SceneFile, OrbitAndRecordedPaths) {
  writeFileAtomically(folder_ / "hand.txt", "0 0 0 0 0 0 0 1\n10 1 0 0 0 0 0 1\n");
  const Scene recorded =
      load({"path={type: recorded, file: hand.txt, scale: 2, time_scale: 0.01, "
            "T_world_recorded: {position: [0, 0, 1]}}"});
  EXPECT_LT((recorded.path->pose(0.05).translation - Vector3d(1, 0, 1)).norm(), 1e-9);
  const Scene orbit =
      load({"path={type: orbit, center: [0, 0, 0.6], radius_m: 0.5, height_m: 0.2}"});
  EXPECT_LT((orbit.path->pose(0).translation - Vector3d(0.5, 0, 0.8)).norm(), 1e-9);
}

TEST_F(SceneFile, EveryKindOfPath) {
  const Scene rest =
      load({"path={type: rest, position: [1, 0, 1], look_at: small, offset: [0, 0, 0.1]}"});
  const Vector3d p_camera =
      rest.path->pose(0).inverse() * (rest.objects[2].T_world_object * Vector3d(0, 0, 0.1));
  EXPECT_LT(p_camera.head<2>().norm(), 1e-12);
  const Scene dolly =
      load({"path={type: dolly, from: [1, 0, 1], to: [2, 0, 1], end_s: 0.2, look_at: [0, 0, 0]}"});
  EXPECT_LT((dolly.path->pose(0.1).translation - Vector3d(1.5, 0, 1)).norm(), 1e-12);
  const Scene follow =
      load({"path={type: follow, position: {type: orbit, radius_m: 1, height_m: 0, azimuth_swing: "
            "[1, 4]},"
            " look_at: [0, 0, -1], roll_rad: 0.1}"});
  EXPECT_LT((follow.path->pose(0).translation - Vector3d(1, 0, 0)).norm(), 1e-12);
  const Scene sequence =
      load({"path={type: sequence, segments: [{duration_s: 0.1, type: rest, position: [1, 0, 1], "
            "look_at: [0, 0, 0]}, {duration_s: 1, type: rest, position: [2, 0, 1], look_at: box}], "
            "shake: [{amplitude_m: 0, amplitude_rad: 0.01, band_hz: [1, 2], seed: 4}, "
            "{amplitude_m: 0}], "
            "glances: [{t: [0.05, 0.1], look_at: [3, 3, 3], turn_s: 0.02}]}"});
  EXPECT_LT((sequence.path->pose(0).translation - Vector3d(1, 0, 1)).norm(), 1e-12);
  EXPECT_LT((sequence.path->pose(0.7).translation - Vector3d(2, 0, 1)).norm(), 1e-12);
}

TEST_F(SceneFile, ObjectsMoveOnPathsOfTheirOwn) {
  const std::string path = "{type: dolly, from: [0, 0, 1], to: [0, 1, 1], end_s: 1, yaw_rad: 0.5}";
  const Scene scene = load({"objects.1={name: cart, model: box.obj, path: " + path + "}",
                            "path={type: rest, position: [1, 0, 1], look_at: cart}"});
  const SceneObject& cart = scene.objects[1];
  EXPECT_EQ(cart.T_world_object.translation, Vector3d(0, 0, 1));
  EXPECT_LT((cart.pose(0.5).translation - Vector3d(0, 0.5, 1)).norm(), 1e-12);
  EXPECT_NEAR(logSO3(cart.pose(1).rotation).z(), 0.5, 1e-12);
  EXPECT_LT((scene.path->pose(0.5).inverse() * cart.pose(0.5).translation).head<2>().norm(), 1e-12);
  EXPECT_NE(describeScene(scene),
            describeScene(load({"objects.1={name: cart, model: box.obj, path: " +
                                    path.substr(0, path.size() - 4) + "0.6}}",
                                "path={type: rest, position: [1, 0, 1], look_at: cart}"})));
}

TEST_F(SceneFile, BadPathsAreToldWhereTheyStand) {
  for (const char* path :
       {"{type: rest, position: [1, 0, 1]}", "{type: rest, position: [1, 0, 1], look_at: bocks}",
        "{type: rest, position: [1, 0, 1], look_at: [0, 0, 0], yaw_rad: 1}",
        "{type: rest, position: [1, 0, 1], yaw_rad: 1, roll_rad: 1}",
        "{type: rest, position: [1, 0, 1], look_at: [0, 0, 0], offset: [0, 0, 1]}",
        "{type: dolly, from: [0, 0, 1], to: [0, 1, 1], end_s: 0, yaw_rad: 0}",
        "{type: orbit, radius_m: 1, azimuth_swing: [1, 0]}",
        "{type: orbit, radius_m: 1, azimuth_swing: 3}",
        "{type: orbit, radius_m: 1, azimuth_swing: [[1, 2], 3]}",
        "{type: follow, position: [1, 2, 3], look_at: box}", "{type: sequence, segments: []}",
        "{type: sequence, segments: [{type: orbit, radius_m: 1}]}",
        "{type: sequence, segments: [{type: orbit, radius_m: 1, duration_s: 1, join_s: 0}]}",
        "{type: orbit, radius_m: 1, shake: {band_hz: [3, 1]}}",
        "{type: orbit, radius_m: 1, shake: {amplitude_m: -1}}",
        "{type: orbit, radius_m: 1, glances: [{t: [3, 1], look_at: box}]}",
        "{type: orbit, radius_m: 1, glances: [{t: [1, 3]}]}"}) {
    const std::string line = errorLine([&] { load({std::string("path=") + path}); }, kExitBadData);
    EXPECT_THAT(line, HasSubstr("path")) << path;
  }
  EXPECT_THAT(errorWith("on: desk, at: [0.1, 0.2]", "path: {type: orbit, radius_m: 1}, on: desk"),
              HasSubstr("needs one of"));
}

TEST_F(SceneFile, ErrorsNameThePlaceAndTheNearestName) {
  const std::string file = (folder_ / "scene.yaml").string();
  EXPECT_THAT(errorWith("exposure_s", "exposre_s"), StartsWith(file + ":2:"));
  EXPECT_THAT(errorWith("exposure_s", "exposre_s"), HasSubstr("did you mean `exposure_s`?"));
  EXPECT_THAT(errorWith("seed: 7", "sed: 7"), HasSubstr("did you mean `seed`?"));
  EXPECT_THAT(errorWith("on: desk", "on: deck"), HasSubstr("did you mean `desk`?"));
  EXPECT_THAT(errorWith("radtan", "radtam"), HasSubstr("did you mean `radtan`?"));
  EXPECT_THAT(errorWith("width: 64", "width: wide"), StartsWith(file + ":2:32: "));
  EXPECT_THAT(errorWith("type: spline", "type: splines"), HasSubstr("did you mean `spline`?"));
  EXPECT_THAT(errorWith("model: box.obj", "model: boks.obj", kExitMissingInput),
              StartsWith(file + ":12:"));
  EXPECT_THAT(errorWith("environment: room", "environment: room_desc", kExitMissingInput),
              HasSubstr("did you mean `room_desk`?"));
  EXPECT_THAT(errorWith("model: box.obj", "model: orange_juice_cartn", kExitMissingInput),
              HasSubstr("did you mean `orange_juice_carton`?"));
}

TEST_F(SceneFile, BadValuesAreToldWhereTheyStand) {
  const std::vector<std::pair<std::string, std::string>> changes = {
      {"width: 64", "width: 0"},
      {"height: 48", "height: -5"},
      {"width: 64", "width: 1000000"},
      {"fx: 50", "fx: 0"},
      {"fx: 50", "fx: nan"},
      {"[-0.1, 0.02, 0, 0]", "[-0.1, 0.02, 0]"},
      {"[-0.1, 0.02, 0, 0]", "[-0.1, .nan, 0, 0]"},
      {"rate_hz: 30", "rate_hz: 0"},
      {"exposure_s: 0.008", "exposure_s: 0.2"},
      {"duration_s: 0.2", "duration_s: 0"},
      {"duration_s: 0.2", "duration_s: -3"},
      {"duration_s: 0.2", "duration_s: 1e9"},
      {"duration_s: 0.2", "duration_s: 80000"},  // more than a million frames
      {"duration_s: 0.2", ""},
      {"position: [0, 1, 2]", "position: [0, .nan, 2]"},
      {"position: [0, 1, 2]", "position: [0, .inf, 2]"},
      {"position: [0, 1, 2]", "position: [0, 1]"},
      {"position: [0, 1, 2]", "position: [0, 1e30, 2]"},
      {"[0, 0, 0, 2]", "[0, 0, 0, 0]"},
      {"[0, 0, 0, 2]", "[0, 0, 0, .nan]"},
      {"[0, 0, 0, 2]", "[0, 0, 2]"},
      {"name: other", "name: box"},
      {"name: other", "name: a/b"},
      {"name: other", "name: .."},
      {"name: other", "name: ''"},
      {"name: other", "name: [a]"},
      {"scale: 0.5", "scale: 0"},
      {"scale: 0.5", "scale: -1"},
      {"up: y", "up: x"},
      {"track: true", "track: maybe"},
      {"axis: [0, 0, 2]", "axis: [0, 0, 0]"},
      {"{axis: [0, 0, 2]}", "[1, 2, 3]"},
      {"{axis: [0, 0, 2]}", "[2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]"},
      {"at: [0.1, 0.2]", "at: [0.1, 7]"},
      {"at: [0.1, 0.2]", "at: [0.1]"},
      {"on: desk, at: [0.1, 0.2], ", ""},
      {"t: 0.1,", "t: 0,"},
      {"t: 0.1,", "t: 0.3,"},
      {"look_at: [0, 0, 0.6]}", "look_at: [1, 0, 0.8]}"},
      {"look_at: [0, 0, 0.6]}", "}"},
      {"half_v: [0, -0.2, 0]", "half_v: [1, 0, 0]"},
      {"radiance: [9, 9, 8]", "radiance: [9, -9, 8]"},
      {"noise: false", "noise: 3"},
      {"drift_m_per_m: 0.03", "drift_m_per_m: -1"},
      {"seed: 7", "seed: -7"},
      {"seed: 7", "seed: 7\nseed: 8"},
  };
  for (const auto& [before, after] : changes)
    EXPECT_THAT(errorWith(before, after), StartsWith((folder_ / "scene.yaml").string() + ":"))
        << after;
  const std::string text = yaml();
  const size_t begin = text.find("keyframes:");
  const std::string keyframes = text.substr(begin, text.find("objects:") - begin);
  EXPECT_THAT(errorWith(keyframes, "keyframes: []\n"), HasSubstr("no keyframes"));
}

TEST_F(SceneFile, MissingFilesAreMissingInput) {
  errorLine([&] { loadScene(folder_ / "none.yaml"); }, kExitMissingInput);
  errorLine([&] { load({"path={type: recorded, file: none.txt}"}); }, kExitMissingInput);
  std::filesystem::remove(folder_ / "room/plane.obj");
  errorLine([&] { load(); }, kExitMissingInput);
}

TEST_F(SceneFile, BrokenMeshesUnderObjectsOnASurfaceAreBadData) {
  writeFileAtomically(folder_ / "box.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n");
  errorLine([&] { load(); }, kExitBadData);
  writeFileAtomically(folder_ / "box.obj", "");
  errorLine([&] { load(); }, kExitBadData);
}

}  // namespace
}  // namespace diorama
