#include "sim/path_reader.h"

#include "core/text.h"
#include "sim/yaml_values.h"

namespace diorama {
namespace {

constexpr double kMaxTime_s = 1e6;
constexpr double kMaxAngle_rad = 1e3;

Keyframe readKeyframe(const YamlValue& value) {
  YamlMap map = value.asMap();
  Keyframe keyframe;
  keyframe.time_s = readNumber(map.require("t"), -kMaxTime_s, kMaxTime_s);
  const YamlValue position = map.require("position");
  keyframe.T_world_camera.translation = readPoint(position);
  const auto target = map.find("look_at"), rotation = map.find("quaternion_xyzw");
  const auto roll = map.find("roll_rad");
  if (target.has_value() == rotation.has_value())
    value.fail("needs either `look_at` or `quaternion_xyzw`");
  if (rotation) {
    if (roll) roll->fail("goes with `look_at` only");
    keyframe.T_world_camera.rotation = readQuaternion(*rotation);
  } else {
    const Vector3d p = readPoint(*target);
    if ((p - keyframe.T_world_camera.translation).norm() < 1e-6)
      target->fail("is the camera's own position");
    const double roll_rad = roll ? readNumber(*roll, -kMaxAngle_rad, kMaxAngle_rad) : 0;
    keyframe.T_world_camera = lookAt(keyframe.T_world_camera.translation, p, roll_rad);
  }
  map.finish();
  return keyframe;
}

std::unique_ptr<MotionPath> readSpline(YamlMap& map) {
  constexpr double kLeastStep_s = 1e-3;
  const YamlValue list = map.require("keyframes");
  std::vector<Keyframe> keyframes;
  for (const YamlValue& value : list.asList()) {
    const Keyframe keyframe = readKeyframe(value);
    if (!keyframes.empty() && keyframe.time_s < keyframes.back().time_s + kLeastStep_s)
      value.fail("must be at least 1 ms after the keyframe before it",
                 "that one is at " + formatNumber(keyframes.back().time_s) + " s");
    keyframes.push_back(keyframe);
  }
  if (keyframes.empty()) list.fail("has no keyframes");
  return makeSplinePath(keyframes);
}

std::unique_ptr<MotionPath> readOrbit(YamlMap& map) {
  Orbit orbit;
  if (auto value = map.find("center")) orbit.center = readPoint(*value);
  orbit.radius_m = readNumber(map.require("radius_m"), 1e-3, 1e5);
  if (auto value = map.find("height_m")) orbit.height_m = readNumber(*value, -1e5, 1e5);
  if (auto value = map.find("start_rad"))
    orbit.start_rad = readNumber(*value, -kMaxAngle_rad, kMaxAngle_rad);
  if (auto value = map.find("rate_rad_s"))
    orbit.rate_rad_s = readNumber(*value, -kMaxAngle_rad, kMaxAngle_rad);
  return makeOrbitPath(orbit);
}

std::unique_ptr<MotionPath> readRecorded(YamlMap& map, const std::filesystem::path& folder) {
  const std::string file = map.require("file").asString();
  RecordingFormat format = RecordingFormat::kTum;
  if (auto value = map.find("format"))
    format = static_cast<RecordingFormat>(value->asChoice({"tum", "euroc"}));
  Placement placement;
  if (auto value = map.find("T_world_recorded")) placement.T_world_recorded = readPose(*value);
  if (auto value = map.find("time_scale")) placement.time_scale = readNumber(*value, 1e-3, 1e3);
  if (auto value = map.find("scale")) placement.scale = readNumber(*value, 1e-6, 1e6);
  return makeRecordedPath(readRecording(folder / file, format), placement);
}

}  // namespace

std::shared_ptr<const MotionPath> readPath(const YamlValue& value,
                                           const std::filesystem::path& folder) {
  YamlMap map = value.asMap();
  std::unique_ptr<MotionPath> path;
  switch (map.require("type").asChoice({"spline", "orbit", "recorded"})) {
    case 0:
      path = readSpline(map);
      break;
    case 1:
      path = readOrbit(map);
      break;
    default:
      path = readRecorded(map, folder);
  }
  map.finish();
  return path;
}

}  // namespace diorama
