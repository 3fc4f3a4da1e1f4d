// Reads a scene file: every value is checked where it stands.
#include <algorithm>
#include <cmath>
#include <map>

#include "core/files.h"
#include "sim/mesh_import.h"
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

struct Surface {
  double z = 0;
  double x_min = 0, x_max = 0, y_min = 0, y_max = 0;
};
using Surfaces = std::map<std::string, Surface>;

struct Interval {
  double min = 0, max = 0;
};
Interval readInterval(const YamlValue& value) {
  const std::vector<double> v = value.asDoubles();
  if (v.size() != 2 || !(v[0] < v[1])) value.fail("must be [min, max]");
  return {v[0], v[1]};
}

Surfaces readSurfaces(const YamlValue& value) {
  Surfaces surfaces;
  YamlMap all = value.asMap();
  for (const std::string& name : all.keys()) {
    YamlMap map = all.require(name).asMap();
    const double z = map.require("z").asDouble();
    const Interval x = readInterval(map.require("x")), y = readInterval(map.require("y"));
    map.finish();
    surfaces[name] = {z, x.min, x.max, y.min, y.max};
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

// The names of the folders under models/ that hold `file(name)`.
template <class FileOf>
std::vector<std::string> knownModels(const FileOf& file) {
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(dataFolder() / "models", error)) {
    const std::string name = entry.path().filename().string();
    if (fs::exists(entry.path() / file(name), error)) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

// A folder under models/ by its name, or a path relative to the scene.
template <class FileOf>
fs::path findModel(const YamlValue& value, const fs::path& scene_folder, const FileOf& file) {
  const std::string name = value.asString();
  const bool is_text = !name.empty() && name.size() < 1000 && name.find('\0') == std::string::npos;
  if (!is_text) value.fail("is no file name");
  std::error_code error;
  if (name.find('/') == std::string::npos) {
    const fs::path known = dataFolder() / "models" / name / file(name);
    if (fs::is_regular_file(known, error)) return known;
  }
  const fs::path own = (scene_folder / name).lexically_normal();
  if (fs::is_regular_file(own, error)) return own;
  if (fs::is_regular_file(own / file(name), error)) return own / file(name);
  const std::string near = nearestName(name, knownModels(file));
  throw MissingInputError(
      value.place(),
      "there is no model `" + name + "`" + (near.empty() ? "" : "; did you mean `" + near + "`?"),
      "a folder under models/ or a path relative to the scene");
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
    readEnvironment();
    if (auto lights = root_.find("lights"))
      for (const AreaLight& light : readLights(*lights)) scene_.lights.push_back(light);
    if (auto ambient = root_.find("ambient"))
      scene_.ambient = readNumber(*ambient, 0, kMaxRadiance);
    const std::optional<YamlValue> objects = root_.find("objects");
    const YamlValue path = root_.require("path");
    root_.finish();  // an unknown key is told before models are imported
    scene_.path = readPath(path, folder_);
    checkPath(path);
    if (objects)
      for (const YamlValue& object : objects->asList()) readObject(object);
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
    const fs::path file =
        findModel(*value, folder_, [](const std::string&) { return "environment.yaml"; });
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

  // Values that are each in range can still make a path beyond all bounds.
  void checkPath(const YamlValue& place) const {
    const int count = scene_.frameCount(), step = std::max(1, count / 1000);
    for (int k = 0; k < count; k += step) {
      const SE3 pose = scene_.T_world_camera(k);
      if (!pose.isFinite() || pose.translation.cwiseAbs().maxCoeff() > 1e7)
        place.fail("leaves the world at frame " + std::to_string(k));
    }
  }

  void readObject(const YamlValue& value) {
    YamlMap map = value.asMap();
    SceneObject object;
    const YamlValue name = map.require("name");
    object.name = readName(name);
    for (const SceneObject& other : scene_.objects)
      if (other.name == object.name) name.fail("`" + object.name + "` stands twice");
    const YamlValue model = map.require("model");
    object.model = model.asString();
    object.mesh = findModel(model, folder_, [](const std::string& n) { return n + ".obj"; });
    if (auto scale = map.find("scale")) object.scale = readNumber(*scale, 1e-9, 1e9);
    if (auto up = map.find("up")) object.y_up = up->asChoice({"z", "y"}) == 1;
    if (auto track = map.find("track")) object.tracked = track->asBool();
    if (auto symmetries = map.find("symmetries")) object.symmetries = readSymmetries(*symmetries);
    const std::optional<YamlValue> on = map.find("on"), pose = map.find("T_world_object");
    if (on.has_value() == pose.has_value()) value.fail("needs either `T_world_object` or `on`");
    if (pose) object.T_world_object = readPose(*pose);
    if (on) place(object, *on, map);
    map.finish();
    constexpr size_t kMaxObjects = 65534;  // 16-bit instance ids
    if (scene_.objects.size() >= kMaxObjects) value.fail("is one object too many");
    scene_.objects.push_back(std::move(object));
  }

  // Puts the object on a surface: its lowest vertex touches it.
  void place(SceneObject& object, const YamlValue& on, YamlMap& map) {
    std::vector<std::string> names;
    for (const auto& [name, surface] : surfaces_) names.push_back(name);
    if (names.empty()) on.fail("needs an environment with surfaces");
    const Surface& surface = surfaces_.at(names[on.asChoice(names)]);
    const YamlValue at = map.require("at");
    const std::vector<double> xy = at.asDoubles();
    if (xy.size() != 2) at.fail("must have 2 numbers, not " + std::to_string(xy.size()), "x, y");
    if (xy[0] < surface.x_min || xy[0] > surface.x_max || xy[1] < surface.y_min ||
        xy[1] > surface.y_max)
      at.fail("is not on the surface",
              "x " + formatNumber(surface.x_min) + " to " + formatNumber(surface.x_max) + ", y " +
                  formatNumber(surface.y_min) + " to " + formatNumber(surface.y_max));
    double yaw_rad = 0;
    if (auto yaw = map.find("yaw_rad")) yaw_rad = readNumber(*yaw, -1e3, 1e3);
    const double lowest_m = lowestPoint(object);
    object.T_world_object = {expSO3({0, 0, yaw_rad}), {xy[0], xy[1], surface.z - lowest_m}};
  }

  double lowestPoint(const SceneObject& object) {
    const auto key = std::make_tuple(object.mesh, object.scale, object.y_up);
    const auto known = lowest_.find(key);
    if (known != lowest_.end()) return known->second;
    const Mesh mesh = importMesh(object.mesh, {object.scale, object.y_up});
    return lowest_[key] = static_cast<double>(mesh.minCorner().z());
  }

  YamlMap& root_;
  fs::path folder_;
  Scene scene_;
  Surfaces surfaces_;
  std::map<std::tuple<fs::path, double, bool>, double> lowest_;
};

}  // namespace

Scene loadScene(const fs::path& file, const std::vector<YamlOverride>& overrides) {
  return parseScene(readFile(file), file, overrides);
}

Scene parseScene(const std::string& content, const fs::path& file,
                 const std::vector<YamlOverride>& overrides) {
  YamlMap root = parseYaml(content, file.string(), overrides);
  return SceneReader(root, file).read();
}

}  // namespace diorama
