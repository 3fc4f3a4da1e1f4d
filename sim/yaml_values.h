// What scene files and sequence files have in common, read from YAML with errors that name the
// place.
#pragma once

#include <string>
#include <utility>

#include "core/camera.h"
#include "core/object_model.h"
#include "core/yaml.h"

namespace diorama {

// {position: [x, y, z], quaternion_xyzw: [x, y, z, w]}, m; the quaternion is normalised.
SE3 readPose(const YamlValue& value);
Eigen::Quaterniond readQuaternion(const YamlValue& value);
// A point in the world, m, within 100 km.
Vector3d readPoint(const YamlValue& value);

// A list of 4x4 row-major rigid transforms (16 numbers, or 4 rows) or {axis: [x, y, z]}.
Symmetries readSymmetries(const YamlValue& value);

// One 4x4 row-major rigid transform: 16 numbers, or 4 rows.
SE3 readRigid(const YamlValue& value);

// model, width, height, fx, fy, cx, cy, distortion of an open mapping.
CameraParameters readCamera(YamlMap& map);

// A name that files can be named after: letters, digits, `_`, `.` and `-`.
std::string readName(const YamlValue& value);

// A number within [min, max].
double readNumber(const YamlValue& value, double min, double max);
// [first, second], increasing and within [min, max].
std::pair<double, double> readInterval(const YamlValue& value, double min, double max);

// A pose, symmetries and a camera as flow YAML that reads back to the same values.
std::string toYaml(const SE3& pose);
std::string toYaml(const Symmetries& symmetries);
std::string toYaml(const CameraParameters& camera);
std::string toYaml(const Vector3d& v);
// A text in double quotes, or plain when it is a name or a path of such.
std::string toYaml(const std::string& text);

}  // namespace diorama
