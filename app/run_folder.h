// Reads what a run wrote; whatever is missing is empty.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/trajectory.h"
#include "core/types.h"

namespace diorama {

// One value per frame.
template <class T>
using PerFrame = std::vector<std::optional<T>>;

struct RunFolderObject {
  std::string name;
  PerFrame<SE3> T_camera_object, T_camera_object_true;
  PerFrame<double> error_m, error_rad, visible, health;
  PerFrame<bool> held;
  PerFrame<Matrix6d> covariance;  // the tracker's own
  std::optional<SE3> T_world_object;
  std::optional<Matrix6d> map_covariance;
};

struct RunFolderEvent {
  int64_t timestamp_ns = 0;
  std::string source, event, reason;
  double value = 0;
  int64_t until_ns = 0;  // of a decision that was repeated
  int frames = 1;
};

struct RunFolder {
  std::filesystem::path path;
  nlohmann::ordered_json metrics, models;
  std::string command, recipe;
  nlohmann::ordered_json verdict;
  std::vector<int> frames;
  std::vector<int64_t> times_ns;
  PerFrame<SE3> T_world_camera, T_world_camera_true;
  PerFrame<double> odometry_health, odometry_ms, tracker_ms, mapper_ms;
  std::vector<RunFolderObject> objects;
  std::vector<RunFolderEvent> events;
  std::vector<double> points;  // x, y, z of each, in the estimated world
};

// Throws MissingInputError without metrics.json and InputError for files that cannot be read.
RunFolder readRunFolder(const std::filesystem::path& folder);

}  // namespace diorama
