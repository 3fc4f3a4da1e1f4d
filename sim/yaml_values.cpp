#include "sim/yaml_values.h"

#include <cmath>

#include "core/text.h"

namespace diorama {
namespace {

constexpr int kMaxImageSide_px = 16384;
constexpr double kWorldSize_m = 1e5;
constexpr const char* kNameLetters =
    "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.-";

Eigen::Matrix4d readMatrix(const YamlValue& value) {
  std::vector<double> numbers;
  const std::vector<YamlValue> items = value.asList();
  if (items.size() == 4) {
    for (const YamlValue& row : items)
      for (double number : row.asDoubles()) numbers.push_back(number);
  } else {
    numbers = value.asDoubles();
  }
  if (numbers.size() != 16)
    value.fail("must have 16 numbers, not " + std::to_string(numbers.size()),
               "a 4x4 matrix, row by row");
  return Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers.data());
}

std::string listOf(const std::vector<double>& numbers) {
  std::string text = "[";
  for (size_t i = 0; i < numbers.size(); ++i) text += (i ? ", " : "") + formatNumber(numbers[i]);
  return text + "]";
}

}  // namespace

Eigen::Quaterniond readQuaternion(const YamlValue& value) {
  const std::vector<double> q = value.asDoubles();
  if (q.size() != 4) value.fail("must have 4 numbers, not " + std::to_string(q.size()), "x y z w");
  const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
  const double norm = rotation.norm();
  if (!std::isfinite(norm) || norm < 1e-6) value.fail("is no rotation", "its length must not be 0");
  // A unit quaternion keeps its digits.
  return std::abs(norm - 1) < 1e-12 ? rotation : rotation.normalized();
}

SE3 readRigid(const YamlValue& value) {
  const Eigen::Matrix4d m = readMatrix(value);
  const Matrix3d R = m.topLeftCorner<3, 3>();
  const bool rigid = (R.transpose() * R - Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-3 &&
                     R.determinant() > 0 &&
                     (m.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() < 1e-9;
  if (!rigid) value.fail("is no rigid motion", "a rotation, a translation and the row 0 0 0 1");
  return SE3::fromMatrix(m);
}

Vector3d readPoint(const YamlValue& value) {
  const Vector3d p = value.asVector3();
  if (p.cwiseAbs().maxCoeff() > kWorldSize_m) value.fail("lies beyond 100 km", "metres");
  return p;
}

SE3 readPose(const YamlValue& value) {
  YamlMap map = value.asMap();
  SE3 pose;
  pose.translation = readPoint(map.require("position"));
  if (auto q = map.find("quaternion_xyzw")) pose.rotation = readQuaternion(*q);
  map.finish();
  return pose;
}

Symmetries readSymmetries(const YamlValue& value) {
  Symmetries symmetries;
  std::vector<YamlValue> entries;
  if (value.isMap())
    entries.push_back(value);
  else
    entries = value.asList();
  for (const YamlValue& entry : entries) {
    if (!entry.isMap()) {
      const SE3 T = readRigid(entry);
      if (log(T).norm() > 1e-9) symmetries.discrete.push_back(T);
      continue;
    }
    YamlMap map = entry.asMap();
    const YamlValue axis = map.require("axis");
    const Vector3d direction = axis.asVector3();
    if (!(direction.norm() > 1e-9) || !std::isfinite(direction.norm()))
      axis.fail("must not be zero");
    if (symmetries.axis) entry.fail("is a second axis", "at most one axis of revolution");
    symmetries.axis = direction.normalized();
    map.finish();
  }
  return symmetries;
}

CameraParameters readCamera(YamlMap& map) {
  CameraParameters camera;
  if (auto model = map.find("model"))
    camera.model = static_cast<CameraModel>(model->asChoice({"pinhole", "radtan", "fisheye"}));
  for (auto [key, side] : {std::pair{"width", &camera.width}, {"height", &camera.height}}) {
    const YamlValue value = map.require(key);
    *side = value.asInt();
    if (*side < 1 || *side > kMaxImageSide_px)
      value.fail("must be between 1 and " + std::to_string(kMaxImageSide_px) + " pixels");
  }
  camera.fx = readNumber(map.require("fx"), 1e-3, 1e7);
  camera.fy = readNumber(map.require("fy"), 1e-3, 1e7);
  camera.cx = (camera.width - 1) / 2.0;
  camera.cy = (camera.height - 1) / 2.0;
  if (auto value = map.find("cx")) camera.cx = readNumber(*value, -1e7, 1e7);
  if (auto value = map.find("cy")) camera.cy = readNumber(*value, -1e7, 1e7);
  if (auto value = map.find("distortion")) camera.distortion = value->asDoubles();
  if (const std::optional<std::string> problem = camera.problem())
    throw InputError(map.place(), *problem);
  return camera;
}

std::string readName(const YamlValue& value) {
  constexpr size_t kMaxLength = 100;
  const std::string name = value.asString();
  if (name.empty() || name.size() > kMaxLength || name.front() == '.' ||
      name.find_first_not_of(kNameLetters) != std::string::npos)
    value.fail("cannot be a name",
               "letters, digits, `_`, `-` and `.`, at most 100, no leading `.`");
  return name;
}

double readNumber(const YamlValue& value, double min, double max) {
  const double number = value.asDouble();
  if (!(number >= min && number <= max))
    value.fail("must be between " + formatNumber(min) + " and " + formatNumber(max));
  return number;
}

std::pair<double, double> readInterval(const YamlValue& value, double min, double max) {
  const std::vector<double> v = value.asDoubles();
  if (v.size() != 2 || !(v[0] < v[1])) value.fail("must be [first, second], increasing");
  if (v[0] < min || v[1] > max)
    value.fail("must lie between " + formatNumber(min) + " and " + formatNumber(max));
  return {v[0], v[1]};
}

std::string toYaml(const Vector3d& v) { return listOf({v.x(), v.y(), v.z()}); }

std::string toYaml(const std::string& text) {
  if (!text.empty() && text.find_first_not_of(std::string(kNameLetters) + "/") == std::string::npos)
    return text;
  std::string quoted = "\"";
  for (char c : text) quoted += (c == '"' || c == '\\' ? "\\" : "") + std::string(1, c);
  return quoted + "\"";
}

std::string toYaml(const SE3& pose) {
  const Eigen::Quaterniond& q = pose.rotation;
  return "{position: " + toYaml(pose.translation) +
         ", quaternion_xyzw: " + listOf({q.x(), q.y(), q.z(), q.w()}) + "}";
}

std::string toYaml(const Symmetries& symmetries) {
  std::string text;
  for (const SE3& T : symmetries.discrete) {
    const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> m = T.matrix();
    text += (text.empty() ? "" : ", ") + listOf({m.data(), m.data() + 16});
  }
  if (symmetries.axis)
    text += (text.empty() ? "" : ", ") + ("{axis: " + toYaml(*symmetries.axis) + "}");
  return "[" + text + "]";
}

std::string toYaml(const CameraParameters& c) {
  return "{model: " + toString(c.model) + ", width: " + std::to_string(c.width) +
         ", height: " + std::to_string(c.height) + ", fx: " + formatNumber(c.fx) +
         ", fy: " + formatNumber(c.fy) + ", cx: " + formatNumber(c.cx) +
         ", cy: " + formatNumber(c.cy) + ", distortion: " + listOf(c.distortion) + "}";
}

}  // namespace diorama
