// Reads a scene file: every value is checked where it stands.
#include <algorithm>
#include <cmath>
#include <map>

#include "core/files.h"
#include "sim/model_lookup.h"
#include "sim/object_reader.h"
#include "sim/occlusion_reader.h"
#include "sim/path_reader.h"
#include "sim/scene.h"
#include "sim/yaml_values.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

// Sizes above these are slips of the pen, not scenes.
constexpr double kMaxDuration_s = 86400;
constexpr int kMaxFrames = 1000000;  // files have six digits
constexpr double kMaxRate_hz = 10000;
constexpr double kMaxRadiance = 1e6;
constexpr double kMaxSize_m = 1e5;

Surfaces readSurfaces(const YamlValue& value) {
  Surfaces surfaces;
  YamlMap all = value.asMap();
  for (const std::string& name : all.keys()) {
    YamlMap map = all.require(name).asMap();
    const double z = map.require("z").asDouble();
    const auto [x_min, x_max] = readInterval(map.require("x"), -kMaxSize_m, kMaxSize_m);
    const auto [y_min, y_max] = readInterval(map.require("y"), -kMaxSize_m, kMaxSize_m);
    map.finish();
    surfaces[name] = {z, x_min, x_max, y_min, y_max};
  }
  all.finish();
  return surfaces;
}

std::vector<AreaLight> readLights(const YamlValue& value) {
  std::vector<AreaLight> lights;
  for (const YamlValue& item : value.asList()) {
    YamlMap map = item.asMap();
    if (auto type = map.find("type")) type->asChoice({"area"});
    AreaLight light;
    light.center = readPoint(map.require("center"));
    light.half_u = readPoint(map.require("half_u"));
    light.half_v = readPoint(map.require("half_v"));
    const YamlValue radiance = map.require("radiance");
    light.radiance = radiance.asVector3();
    if (!(light.half_u.cross(light.half_v).norm() > 1e-12))
      item.fail("has no area", "half_u and half_v must not be parallel");
    if (light.radiance.minCoeff() < 0 || light.radiance.maxCoeff() > kMaxRadiance)
      radiance.fail("must be between 0 and 1000000");
    map.finish();
    lights.push_back(light);
  }
  return lights;
}

class SceneReader {
 public:
  SceneReader(YamlMap& root, const fs::path& file) : root_(root), folder_(file.parent_path()) {
    scene_.name = file.stem().string();
  }

  Scene read() {
    if (auto seed = root_.find("seed")) scene_.seed = seed->asUint64();
    readCameraAndTime();
    readOptions(root_, "effects", scene_.effects);
    readOptions(root_, "odometry", scene_.odometry);
    readOptions(root_, "imu", scene_.imu);
    readEnvironment();
    if (auto lights = root_.find("lights"))
      for (const AreaLight& light : readLights(*lights)) scene_.lights.push_back(light);
    if (auto ambient = root_.find("ambient"))
      scene_.ambient = readNumber(*ambient, 0, kMaxRadiance);
    const std::optional<YamlValue> objects = root_.find("objects"), occlude = root_.find("occlude");
    const YamlValue path = root_.require("path");
    root_.finish();  // an unknown key is told before models are imported
    if (objects) readObjects(*objects, folder_, surfaces_, scene_);
    scene_.path = readPath(path, folder_, scene_.objects);
    checkPath(*scene_.path, scene_, path);
    if (occlude) addOccluders(readOcclusions(*occlude, scene_), scene_);
    return std::move(scene_);
  }

 private:
  void readCameraAndTime() {
    YamlMap camera = root_.require("camera").asMap();
    scene_.camera = readCamera(camera);
    if (auto rate = camera.find("rate_hz")) scene_.rate_hz = readNumber(*rate, 1e-3, kMaxRate_hz);
    if (auto exposure = camera.find("exposure_s"))
      scene_.exposure_s = readNumber(*exposure, 0, 1 / scene_.rate_hz);
    if (auto row_time = camera.find("row_time_s"))  // a frame is read out before the next one
      scene_.row_time_s = readNumber(*row_time, 0, 1 / (scene_.rate_hz * scene_.camera.height));
    camera.finish();
    const YamlValue duration = root_.require("duration_s");
    scene_.duration_s = duration.asDouble();
    if (!(scene_.duration_s > 0 && scene_.duration_s <= kMaxDuration_s))
      duration.fail("must be above 0 and at most a day");
    if (scene_.duration_s * scene_.rate_hz > kMaxFrames)
      duration.fail("makes more than " + std::to_string(kMaxFrames) + " frames");
    if (scene_.frameCount() < 1) duration.fail("is too short for one frame");
  }

  void readEnvironment() {
    const std::optional<YamlValue> value = root_.find("environment");
    if (!value || value->asString() == "none") return;
    const fs::path file = findEnvironment(*value, folder_);
    YamlMap map = loadYaml(file);
    const YamlValue mesh = map.require("mesh");
    scene_.environment_mesh = file.parent_path() / mesh.asString();
    std::error_code error;
    if (!fs::is_regular_file(scene_.environment_mesh, error))
      throw MissingInputError(scene_.environment_mesh, "named in " + mesh.place().toString());
    if (auto lights = map.find("lights")) scene_.lights = readLights(*lights);
    if (auto ambient = map.find("ambient")) scene_.ambient = readNumber(*ambient, 0, kMaxRadiance);
    if (auto surfaces = map.find("surfaces")) surfaces_ = readSurfaces(*surfaces);
    map.finish();
  }

  YamlMap& root_;
  fs::path folder_;
  Scene scene_;
  Surfaces surfaces_;
};

}  // namespace

Scene loadScene(const fs::path& name, const std::vector<YamlOverride>& overrides) {
  const fs::path ours = dataFolder() / name;
  std::error_code error;
  const fs::path file = !fs::exists(name, error) && fs::exists(ours, error) ? ours : name;
  return parseScene(readFile(file), file, overrides);
}

Scene parseScene(const std::string& content, const fs::path& file,
                 const std::vector<YamlOverride>& overrides) {
  YamlMap root = parseYaml(content, file.string(), overrides);
  return SceneReader(root, file).read();
}

}  // namespace diorama
