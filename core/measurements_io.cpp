#include "core/measurements_io.h"

#include <cmath>

#include "core/errors.h"
#include "core/files.h"
#include "core/text.h"

namespace diorama {
namespace {

constexpr size_t kColumns = 13 + 21;
constexpr const char* kCamera = "camera";
constexpr const char* kUpToScale = "camera_up_to_scale";

Matrix6d parseUpperTriangle(const std::vector<std::string_view>& fields, size_t first,
                            const SourcePlace& place) {
  Matrix6d m;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) {
      const std::optional<double> value = parseNumber(fields[first++]);
      if (!value || !std::isfinite(*value)) throw InputError(place, "the covariance is not finite");
      m(row, column) = m(column, row) = *value;
    }
  }
  return m;
}

}  // namespace

std::string formatUpperTriangle(const Matrix6d& m, char separator) {
  std::string text;
  for (int row = 0; row < 6; ++row)
    for (int column = row; column < 6; ++column)
      text += (text.empty() ? "" : std::string(1, separator)) + formatNumber(m(row, column));
  return text;
}

std::string measurementsHeader() {
  std::string header = "timestamp_ns,source,kind,name,from_ns,tx,ty,tz,qx,qy,qz,qw,health";
  for (int row = 0; row < 6; ++row)
    for (int column = row; column < 6; ++column)
      header += ",c" + std::to_string(row) + std::to_string(column);
  return header + "\n";
}

std::string toCsv(const OdometryMeasurement& m) {
  return std::to_string(m.to_ns) + "," + m.source + ",odometry," +
         (m.up_to_scale ? kUpToScale : kCamera) + "," + std::to_string(m.from_ns) + "," +
         formatPose(m.T_from_to, ',') + "," + formatNumber(m.health) + "," +
         formatUpperTriangle(m.covariance, ',') + "\n";
}

std::string toCsv(const ObjectMeasurement& m) {
  return std::to_string(m.timestamp_ns) + "," + m.source + ",object," + m.object + ",," +
         formatPose(m.T_camera_object, ',') + "," + formatNumber(m.health) + "," +
         formatUpperTriangle(m.covariance, ',') + "\n";
}

Measurements readMeasurements(const std::filesystem::path& file) {
  const std::string content = readFile(file);
  Measurements measurements;
  int number = 0;
  for (std::string_view line : split(content, '\n')) {
    ++number;
    line = trim(line);
    if (line.empty() || (number == 1 && line.starts_with("timestamp_ns"))) continue;
    const SourcePlace place{file.string(), number};
    const std::vector<std::string_view> fields = split(line, ',');
    if (fields.size() != kColumns)
      throw InputError(
          place, std::to_string(fields.size()) + " columns instead of " + std::to_string(kColumns),
          "the header is " + std::string(trim(measurementsHeader())));
    const std::optional<int64_t> time = parseInteger(fields[0]);
    const std::optional<SE3> pose = parsePose(fields, 5);
    const std::optional<double> health = parseNumber(fields[12]);
    if (!time) throw InputError(place, "timestamp_ns is no whole number");
    if (!pose) throw InputError(place, "the pose is not finite or its quaternion is zero");
    if (!health || !(*health >= 0 && *health <= 1))
      throw InputError(place, "health must be between 0 and 1");
    const Matrix6d covariance = parseUpperTriangle(fields, 13, place);
    const std::string source(fields[1]), kind(fields[2]), name(fields[3]);
    if (kind == "odometry") {
      const std::optional<int64_t> from = parseInteger(fields[4]);
      if (!from || *from >= *time)
        throw InputError(place, "from_ns must be a time before timestamp_ns");
      measurements.odometry.push_back(
          {source, *from, *time, *pose, covariance, *health, name == kUpToScale});
    } else if (kind == "object") {
      measurements.objects.push_back({source, name, *time, *pose, covariance, *health, true, ""});
    } else {
      throw InputError(place, "unknown kind `" + kind + "`", "possible: odometry, object");
    }
  }
  return measurements;
}

}  // namespace diorama
