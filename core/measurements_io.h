// measurements.csv: what sensors and trackers said, to the last digit, so that it can be replayed.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/measurements.h"

namespace diorama {

struct Measurements {
  std::vector<OdometryMeasurement> odometry;
  std::vector<ObjectMeasurement> objects;
};

// Columns: timestamp_ns,source,kind,name,from_ns,tx,ty,tz,qx,qy,qz,qw,health,c00..c55 (upper
// triangle). The name of odometry is `camera`, or `camera_up_to_scale`.
std::string measurementsHeader();
std::string toCsv(const OdometryMeasurement& measurement);  // one line
std::string toCsv(const ObjectMeasurement& measurement);    // one line

// Throws MissingInputError, or InputError with the line.
Measurements readMeasurements(const std::filesystem::path& file);

// The 21 entries of the upper triangle, row by row, and back.
std::string formatUpperTriangle(const Matrix6d& m, char separator);

}  // namespace diorama
