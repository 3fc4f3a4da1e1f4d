#include "sim/scene.h"

#include <yaml-cpp/yaml.h>

#include <cmath>

#include "core/sha256.h"
#include "sim/model_files.h"
#include "sim/yaml_values.h"

namespace diorama {
namespace {

// Poses in the middle of the frames, and at the ends of their exposures, stand for the path.
std::string pathChecksum(const Scene& scene, const MotionPath& path) {
  Sha256 hash;
  for (int k = 0; k < scene.frameCount(); ++k) {
    const double middle_s = scene.time_s(k);
    for (double side : {-0.5, 0.0, 0.5})
      hash.update(formatPose(path.pose(middle_s + side * scene.exposure_s), ' ') + "\n");
  }
  return hash.hexDigest();
}

std::string describeObject(const Scene& scene, const SceneObject& object) {
  const std::string place = object.path ? ", path_sha256: " + pathChecksum(scene, *object.path)
                                        : ", T_world_object: " + toYaml(object.T_world_object);
  return "{name: " + object.name + ", mesh_sha256: " + modelChecksum(object.mesh) +
         ", scale: " + formatNumber(object.scale) + ", up: " + (object.y_up ? "y" : "z") + place +
         ", track: " + (object.tracked ? "true" : "false") +
         ", symmetries: " + toYaml(object.symmetries) + "}";
}

std::string describeLight(const AreaLight& light) {
  return "{type: area, center: " + toYaml(light.center) + ", half_u: " + toYaml(light.half_u) +
         ", half_v: " + toYaml(light.half_v) + ", radiance: " + toYaml(light.radiance) + "}";
}

}  // namespace

int Scene::frameCount() const {
  constexpr double kSlack = 1e-6;  // 0.1 s at 30 Hz are 3 frames, not 4
  return static_cast<int>(std::ceil(duration_s * rate_hz - kSlack));
}

int64_t Scene::timestampNs(int frame) const { return std::llround(frame * 1e6 / rate_hz) * 1000; }

int64_t Scene::halfExposureNs() const { return std::llround(exposure_s * 1e6 / 2) * 1000; }

SE3 Scene::T_world_camera(int frame) const { return path->pose(time_s(frame)); }

std::string describeStage(const Scene& scene) {
  std::string text = "camera: " + toYaml(scene.camera) + "\n";
  text += "rate_hz: " + formatNumber(scene.rate_hz) + "\n";
  text += "exposure_s: " + formatNumber(scene.exposure_s) + "\n";
  text += "row_time_s: " + formatNumber(scene.row_time_s) + "\n";
  text += "duration_s: " + formatNumber(scene.duration_s) + "\n";
  text += "path_sha256: " + pathChecksum(scene, *scene.path) + "\n";
  text += "environment_sha256: " +
          (scene.environment_mesh.empty() ? "none" : modelChecksum(scene.environment_mesh)) + "\n";
  text += "objects:\n";
  for (const SceneObject& object : scene.objects)
    text += "  - " + describeObject(scene, object) + "\n";
  return text;
}

std::string describeScene(const Scene& scene) {
  std::string text = "seed: " + std::to_string(scene.seed) + "\n" + describeStage(scene);
  text += "lights:\n";
  for (const AreaLight& light : scene.lights) text += "  - " + describeLight(light) + "\n";
  text += "ambient: " + formatNumber(scene.ambient) + "\n";
  YAML::Emitter options;
  options << YAML::BeginMap;
  writeOptions(options, "effects", scene.effects);
  writeOptions(options, "odometry", scene.odometry);
  writeOptions(options, "imu", scene.imu);
  options << YAML::EndMap;
  return text + options.c_str() + "\n";
}

}  // namespace diorama
