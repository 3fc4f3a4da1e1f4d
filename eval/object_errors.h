// Errors of an object's pose over a sequence: the metrics of `metrics.json`.
#pragma once

#include <optional>
#include <span>

#include "core/map_estimate.h"
#include "core/object_model.h"
#include "eval/metrics.h"

namespace diorama {

// Reported errors from here on do not enter the means (paper).
inline constexpr double kFar_m = 0.5;

// What was said about the object in one frame, and what is true.
struct ObjectFrame {
  std::optional<SE3> truth;     // T_camera_object; a frame without it has no errors
  std::optional<SE3> reported;  // the method's estimate of T_camera_object without hindsight
  bool claimed = false;         // the tracker says that it holds the object
  std::optional<SE3> raw;       // the tracker's own T_camera_object, before any gate
  std::optional<Matrix6d> raw_covariance;
  std::optional<double> visible_fraction;
};

// Everything that follows from the frames: all but `reinitialisations` and `map_*`. The span must
// hold every frame of the sequence, reported or not.
ObjectMetrics evaluateObject(std::span<const ObjectFrame> frames, const ObjectModel& model);

// Sets map_error_m, map_error_rad and map_nees: the final map against T_camera(start)_object.
void evaluateMap(const ObjectEstimate& estimate, const SE3& T_start_object,
                 const Symmetries& symmetries, ObjectMetrics& metrics);

// Mean normalised error of an odometry: T_from_to estimated, its covariance, and the true motion.
struct OdometryFrame {
  SE3 estimate;
  Matrix6d covariance = Matrix6d::Identity();
  SE3 truth;
};
std::optional<double> odometryNees(std::span<const OdometryFrame> frames);

}  // namespace diorama
