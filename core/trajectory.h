// Time-stamped poses and the TUM text format: `timestamp tx ty tz qx qy qz qw`, seconds.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/se3.h"

namespace diorama {

struct StampedPose {
  int64_t timestamp_ns = 0;
  SE3 pose;
};

struct Trajectory {
  std::vector<StampedPose> poses;  // times strictly increasing

  // The pose whose time is nearest and within max_gap_ns; nothing otherwise.
  const StampedPose* nearest(int64_t timestamp_ns, int64_t max_gap_ns) const;
};

// Throws MissingInputError or InputError (file:line) on a missing or malformed file, times that do
// not increase, and quaternions that are not finite or nearly zero; other quaternions are
// normalised.
Trajectory readTum(const std::filesystem::path& file);

// Times with 6 decimals, poses so that reading them gives the same numbers.
std::string toTum(const Trajectory& trajectory, const std::string& header = "");
std::string toTum(const StampedPose& pose);  // one line

}  // namespace diorama
