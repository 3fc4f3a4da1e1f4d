#include "sim/object_reader.h"

#include <algorithm>
#include <tuple>

#include "core/text.h"
#include "sim/mesh_import.h"
#include "sim/model_lookup.h"
#include "sim/path_reader.h"
#include "sim/solid.h"
#include "sim/yaml_values.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

class ObjectReader {
 public:
  ObjectReader(const fs::path& folder, const Surfaces& surfaces, Scene& scene)
      : folder_(folder), surfaces_(surfaces), scene_(scene) {}

  void read(const YamlValue& value) {
    YamlMap map = value.asMap();
    SceneObject object;
    const YamlValue name = map.require("name");
    object.name = readName(name);
    for (const SceneObject& other : scene_.objects)
      if (other.name == object.name) name.fail("`" + object.name + "` stands twice");
    const YamlValue model = map.require("model");
    object.model = model.asString();
    object.mesh = findModel(model, folder_);
    if (auto scale = map.find("scale")) object.scale = readNumber(*scale, 1e-9, 1e9);
    if (auto up = map.find("up")) object.y_up = up->asChoice({"z", "y"}) == 1;
    if (auto track = map.find("track")) object.tracked = track->asBool();
    if (auto symmetries = map.find("symmetries")) object.symmetries = readSymmetries(*symmetries);
    constexpr size_t kMaxObjects = 65534;  // 16-bit instance ids
    if (scene_.objects.size() >= kMaxObjects) value.fail("is one object too many");
    meshes_.push_back(meshOf(object));
    readPlace(map, object);
    map.finish();
    scene_.objects.push_back(std::move(object));
    checkOverlap(value);
  }

 private:
  void readPlace(YamlMap& map, SceneObject& object) const {
    const std::optional<YamlValue> on = map.find("on"), pose = map.find("T_world_object"),
                                   path = map.find("path");
    if (on.has_value() + pose.has_value() + path.has_value() != 1)
      map.fail("needs one of `T_world_object`, `on` and `path`");
    if (pose) object.T_world_object = readPose(*pose);
    if (on) place(object, *on, map);
    if (path) {
      object.path = readPath(*path, folder_, scene_.objects);
      checkPath(*object.path, scene_, *path);
      object.T_world_object = object.path->pose(0);
    }
  }

  // Puts the object on a surface, or on another object that rests.
  void place(SceneObject& object, const YamlValue& on, YamlMap& map) const {
    const YamlValue at = map.require("at");
    const std::vector<double> xy = at.asDoubles();
    if (xy.size() != 2) at.fail("must have 2 numbers, not " + std::to_string(xy.size()), "x, y");
    double yaw_rad = 0;
    if (auto yaw = map.find("yaw_rad")) yaw_rad = readNumber(*yaw, -1e3, 1e3);
    object.T_world_object = {expSO3({0, 0, yaw_rad}), {xy[0], xy[1], 0}};
    std::vector<std::string> names;
    for (const auto& [name, surface] : surfaces_) names.push_back(name);
    for (const SceneObject& other : scene_.objects) names.push_back(other.name);
    if (names.empty()) on.fail("needs an environment with surfaces or an object before it");
    const size_t choice = on.asChoice(names);
    object.T_world_object.translation.z() =
        choice < surfaces_.size() ? heightOn(surfaces_.at(names[choice]), at, xy)
                                  : heightOn(choice - surfaces_.size(), object.T_world_object, on);
  }

  // So that the lowest vertex touches the surface.
  double heightOn(const Surface& surface, const YamlValue& at,
                  const std::vector<double>& xy) const {
    if (xy[0] < surface.x_min || xy[0] > surface.x_max || xy[1] < surface.y_min ||
        xy[1] > surface.y_max)
      at.fail("is not on the surface",
              "x " + formatNumber(surface.x_min) + " to " + formatNumber(surface.x_max) + ", y " +
                  formatNumber(surface.y_min) + " to " + formatNumber(surface.y_max));
    return surface.z - static_cast<double>(meshes_.back()->minCorner().z());
  }

  // Where it stops when it is lowered from above.
  double heightOn(size_t lower, SE3 T_world_object, const YamlValue& on) const {
    const SceneObject& other = scene_.objects[lower];
    if (other.path) on.fail("`" + other.name + "` moves", "put it on something that rests");
    constexpr double kHigh_m = 10;  // above everything that is not a slip of the pen
    const Mesh& below = *meshes_[lower];
    T_world_object.translation.z() =
        other.T_world_object.translation.z() + below.diameter() + kHigh_m;
    const std::optional<double> fall_m =
        freeFall_m({*meshes_.back(), T_world_object}, {below, other.T_world_object});
    if (!fall_m) on.fail("`" + other.name + "` is not below `at`");
    return T_world_object.translation.z() - *fall_m;
  }

  // The newest object against all others, at several times when one of them moves.
  void checkOverlap(const YamlValue& place) const {
    constexpr int kInstants = 16;
    const SceneObject& newest = scene_.objects.back();
    for (size_t i = 0; i + 1 < scene_.objects.size(); ++i) {
      const SceneObject& other = scene_.objects[i];
      const int instants = newest.path || other.path ? kInstants : 1;
      for (int k = 0; k < instants; ++k) {
        const double time_s = scene_.duration_s * k / kInstants;
        if (overlap({*meshes_.back(), newest.pose(time_s)}, {*meshes_[i], other.pose(time_s)}))
          place.fail("stands in another object: `" + newest.name + "` and `" + other.name +
                         "` overlap" + (instants > 1 ? " at " + formatNumber(time_s) + " s" : ""),
                     "move one of them");
      }
    }
  }

  std::shared_ptr<const Mesh> meshOf(const SceneObject& object) {
    std::shared_ptr<const Mesh>& mesh = known_[{object.mesh, object.scale, object.y_up}];
    if (!mesh) mesh = std::make_shared<Mesh>(importMesh(object.mesh, {object.scale, object.y_up}));
    return mesh;
  }

  const fs::path& folder_;
  const Surfaces& surfaces_;
  Scene& scene_;
  std::vector<std::shared_ptr<const Mesh>> meshes_;  // of the objects
  std::map<std::tuple<fs::path, double, bool>, std::shared_ptr<const Mesh>> known_;
};

}  // namespace

void readObjects(const YamlValue& list, const fs::path& folder, const Surfaces& surfaces,
                 Scene& scene) {
  ObjectReader reader(folder, surfaces, scene);
  for (const YamlValue& value : list.asList()) reader.read(value);
}

void checkPath(const MotionPath& path, const Scene& scene, const YamlValue& place) {
  constexpr double kMaxDistance_m = 1e7;
  const int count = scene.frameCount(), step = std::max(1, count / 1000);
  for (int k = 0; k < count; k += step) {
    const SE3 pose = path.pose(scene.time_s(k));
    if (!pose.isFinite() || pose.translation.cwiseAbs().maxCoeff() > kMaxDistance_m)
      place.fail("leaves the world at frame " + std::to_string(k));
  }
}

}  // namespace diorama
