#include "sim/path_reader.h"

#include <cmath>

#include "core/text.h"
#include "sim/yaml_values.h"

namespace diorama {
namespace {

// Sizes above these are slips of the pen, not motions.
constexpr double kMaxTime_s = 1e6;
constexpr double kMaxAngle_rad = 1e3;
constexpr double kMaxLength_m = 1e5;
constexpr double kLeastTime_s = 1e-3;
constexpr double kMaxFrequency_hz = 1e3;
constexpr double kLeastRadius_m = 1e-3;

class PathReader {
 public:
  PathReader(const std::filesystem::path& folder, std::span<const SceneObject> objects)
      : folder_(folder), objects_(objects) {}

  MotionPathPtr read(YamlMap& map) {
    MotionPathPtr path = readPlain(map);
    if (auto glances = map.find("glances")) path = readGlances(*glances, path);
    if (auto shake = map.find("shake")) path = readShakes(*shake, path);
    return path;
  }

 private:
  MotionPathPtr readPlain(YamlMap& map) {
    switch (map.require("type").asChoice(
        {"spline", "orbit", "dolly", "rest", "follow", "recorded", "sequence"})) {
      case 0:
        return readSpline(map);
      case 1:
        return readOrbit(map);
      case 2:
        return readDolly(map);
      case 3: {
        const Vector3d position = readPoint(map.require("position"));
        return makeAimedPath([position](double) { return position; }, requireAim(map));
      }
      case 4: {
        const MotionPathPtr path = readNested(map.require("position"));
        return makeAimedPath([path](double t) { return path->pose(t).translation; },
                             requireAim(map));
      }
      case 5:
        return readRecorded(map);
      default:
        return readSequence(map);
    }
  }

  MotionPathPtr readNested(const YamlValue& value) {
    YamlMap map = value.asMap();
    MotionPathPtr path = read(map);
    map.finish();
    return path;
  }

  // A point, or an object that may move.
  PointOverTime readTarget(const YamlValue& value, YamlMap& map) const {
    const auto offset = map.find("offset");
    if (!value.isText()) {
      if (offset) offset->fail("goes with the name of an object only");
      const Vector3d point = readPoint(value);
      return [point](double) { return point; };
    }
    std::vector<std::string> names;
    for (const SceneObject& object : objects_) names.push_back(object.name);
    if (names.empty()) value.fail("must be [x, y, z]", "no object stands before it");
    const SceneObject object = objects_[value.asChoice(names)];
    const Vector3d point = offset ? readPoint(*offset) : Vector3d::Zero();
    return [object, point](double time_s) -> Vector3d { return object.pose(time_s) * point; };
  }

  std::optional<Aim> findAim(YamlMap& map) const {
    const auto target = map.find("look_at"), rotation = map.find("quaternion_xyzw"),
               yaw = map.find("yaw_rad"), roll = map.find("roll_rad");
    if (target.has_value() + rotation.has_value() + yaw.has_value() > 1)
      map.fail("must have only one of `look_at`, `quaternion_xyzw` and `yaw_rad`");
    if (roll && !target) roll->fail("goes with `look_at` only");
    if (rotation) return aimFixed(readQuaternion(*rotation));
    if (yaw) return aimFixed(expSO3({0, 0, readNumber(*yaw, -kMaxAngle_rad, kMaxAngle_rad)}));
    if (!target) return std::nullopt;
    const double roll_rad = roll ? readNumber(*roll, -kMaxAngle_rad, kMaxAngle_rad) : 0;
    return aimAt(readTarget(*target, map), roll_rad);
  }

  Aim requireAim(YamlMap& map) const {
    const std::optional<Aim> aim = findAim(map);
    if (!aim) map.fail("needs `look_at`, `quaternion_xyzw` or `yaw_rad`");
    return *aim;
  }

  Keyframe readKeyframe(const YamlValue& value) const {
    YamlMap map = value.asMap();
    Keyframe keyframe;
    keyframe.time_s = readNumber(map.require("t"), -kMaxTime_s, kMaxTime_s);
    keyframe.pose.translation = readPoint(map.require("position"));
    if (const auto target = map.find("look_at"); target && !target->isText())
      if ((readPoint(*target) - keyframe.pose.translation).norm() < 1e-6)
        target->fail("is the camera's own position");
    keyframe.pose.rotation = requireAim(map)(keyframe.time_s, keyframe.pose.translation);
    map.finish();
    return keyframe;
  }

  MotionPathPtr readSpline(YamlMap& map) const {
    const YamlValue list = map.require("keyframes");
    std::vector<Keyframe> keyframes;
    for (const YamlValue& value : list.asList()) {
      const Keyframe keyframe = readKeyframe(value);
      if (!keyframes.empty() && keyframe.time_s < keyframes.back().time_s + kLeastTime_s)
        value.fail("must be at least 1 ms after the keyframe before it",
                   "that one is at " + formatNumber(keyframes.back().time_s) + " s");
      keyframes.push_back(keyframe);
    }
    if (keyframes.empty()) list.fail("has no keyframes");
    return makeSplinePath(keyframes);
  }

  static Swing readSwing(const YamlValue& value) {
    const std::vector<double> v = value.asDoubles();
    if (v.size() != 2 || std::abs(v[0]) > kMaxLength_m || v[1] < kLeastTime_s || v[1] > kMaxTime_s)
      value.fail("must be [amplitude, period_s]", "a period of at least 1 ms");
    return {v[0], v[1]};
  }

  // One pair or a list of pairs.
  static Swings readSwings(YamlMap& map, const std::string& key) {
    Swings swings;
    const auto value = map.find(key);
    if (!value) return swings;
    const std::vector<YamlValue> items = value->asList();
    if (!items.empty() && !items.front().isList()) return {readSwing(*value)};
    for (const YamlValue& item : items) swings.push_back(readSwing(item));
    return swings;
  }

  MotionPathPtr readOrbit(YamlMap& map) const {
    Orbit orbit;
    if (auto value = map.find("center")) orbit.center = readPoint(*value);
    orbit.radius_m = readNumber(map.require("radius_m"), kLeastRadius_m, kMaxLength_m);
    if (auto value = map.find("height_m"))
      orbit.height_m = readNumber(*value, -kMaxLength_m, kMaxLength_m);
    if (auto value = map.find("start_rad"))
      orbit.start_rad = readNumber(*value, -kMaxAngle_rad, kMaxAngle_rad);
    if (auto value = map.find("rate_rad_s"))
      orbit.rate_rad_s = readNumber(*value, -kMaxAngle_rad, kMaxAngle_rad);
    orbit.azimuth_swing = readSwings(map, "azimuth_swing");
    orbit.radius_swing = readSwings(map, "radius_swing");
    orbit.height_swing = readSwings(map, "height_swing");
    const Aim at_center = aimAt([center = orbit.center](double) { return center; });
    return makeAimedPath(onOrbit(orbit), findAim(map).value_or(at_center));
  }

  MotionPathPtr readDolly(YamlMap& map) const {
    const Vector3d from = readPoint(map.require("from")), to = readPoint(map.require("to"));
    double start_s = 0;
    if (auto value = map.find("start_s")) start_s = readNumber(*value, -kMaxTime_s, kMaxTime_s);
    const double end_s = readNumber(map.require("end_s"), start_s + kLeastTime_s, kMaxTime_s);
    return makeAimedPath(onDolly(from, to, start_s, end_s), requireAim(map));
  }

  MotionPathPtr readRecorded(YamlMap& map) const {
    const std::string file = map.require("file").asString();
    RecordingFormat format = RecordingFormat::kTum;
    if (auto value = map.find("format"))
      format = static_cast<RecordingFormat>(value->asChoice({"tum", "euroc"}));
    Placement placement;
    if (auto value = map.find("T_world_recorded")) placement.T_world_recorded = readPose(*value);
    if (auto value = map.find("time_scale")) placement.time_scale = readNumber(*value, 1e-3, 1e3);
    if (auto value = map.find("scale")) placement.scale = readNumber(*value, 1e-6, 1e6);
    return makeRecordedPath(readRecording(folder_ / file, format), placement);
  }

  MotionPathPtr readSequence(YamlMap& map) {
    const YamlValue list = map.require("segments");
    std::vector<Segment> segments;
    for (const YamlValue& value : list.asList()) {
      YamlMap item = value.asMap();
      Segment segment;
      segment.duration_s = readNumber(item.require("duration_s"), kLeastTime_s, kMaxTime_s);
      if (auto join = item.find("join_s"))
        segment.join_s = readNumber(*join, kLeastTime_s, kMaxTime_s);
      segment.path = read(item);
      item.finish();
      segments.push_back(std::move(segment));
    }
    if (segments.empty()) list.fail("has no segments");
    return makeSequencePath(segments);
  }

  // One shake or several.
  static MotionPathPtr readShakes(const YamlValue& value, MotionPathPtr path) {
    if (value.isMap()) return readShake(value, std::move(path));
    for (const YamlValue& item : value.asList()) path = readShake(item, std::move(path));
    return path;
  }

  static MotionPathPtr readShake(const YamlValue& value, MotionPathPtr path) {
    YamlMap map = value.asMap();
    Shake shake;
    if (auto v = map.find("amplitude_m")) shake.amplitude_m = readNumber(*v, 0, kMaxLength_m);
    if (auto v = map.find("amplitude_rad")) shake.amplitude_rad = readNumber(*v, 0, kMaxAngle_rad);
    if (auto v = map.find("band_hz"))
      std::tie(shake.low_hz, shake.high_hz) = readInterval(*v, 1e-3, kMaxFrequency_hz);
    if (auto v = map.find("seed")) shake.seed = v->asUint64();
    map.finish();
    return makeShakenPath(std::move(path), shake);
  }

  MotionPathPtr readGlances(const YamlValue& value, MotionPathPtr path) const {
    std::vector<Glance> glances;
    for (const YamlValue& item : value.asList()) {
      YamlMap map = item.asMap();
      Glance glance;
      std::tie(glance.start_s, glance.end_s) =
          readInterval(map.require("t"), -kMaxTime_s, kMaxTime_s);
      if (auto turn = map.find("turn_s"))
        glance.turn_s = readNumber(*turn, kLeastTime_s, kMaxTime_s);
      glance.target = readTarget(map.require("look_at"), map);
      map.finish();
      glances.push_back(std::move(glance));
    }
    return makeGlancingPath(std::move(path), glances);
  }

  const std::filesystem::path& folder_;
  std::span<const SceneObject> objects_;
};

}  // namespace

MotionPathPtr readPath(const YamlValue& value, const std::filesystem::path& folder,
                       std::span<const SceneObject> objects) {
  YamlMap map = value.asMap();
  MotionPathPtr path = PathReader(folder, objects).read(map);
  map.finish();
  return path;
}

}  // namespace diorama
