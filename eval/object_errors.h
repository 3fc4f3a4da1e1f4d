// Errors of an object's pose over a sequence: the metrics of `metrics.json`.
#pragma once

#include <optional>
#include <vector>

#include "core/map_estimate.h"
#include "core/object_model.h"
#include "eval/metrics.h"
#include "eval/pose_errors.h"

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

// Gathers what follows from the frames of a sequence: all but `reinitialisations` and `map_*`.
// Every frame must be added, reported or not; what is kept of one is a few numbers. The model must
// outlive it.
class ObjectEvaluation {
 public:
  explicit ObjectEvaluation(const ObjectModel& model);

  void add(const ObjectFrame& frame);
  ObjectMetrics metrics() const;

 private:
  // Counts of a ratio; nothing over nothing is not known.
  struct Ratio {
    int hits = 0, total = 0;
    void add(bool hit);
    std::optional<double> value() const;
  };

  SE3 nearest(const SE3& estimate, const SE3& truth) const;
  void addReported(const ObjectFrame& frame);
  void addDistance(const ObjectFrame& frame, bool reported);
  void addClaimed(const ObjectFrame& frame);

  const ObjectModel& model_;
  double lever_m_;
  ModelDistance distance_;
  std::vector<double> translations_, rotations_, add_scores_, nees_;
  Ratio reported_, claimed_, near_, success_5_, success_1_, visible_5_, visible_1_, false_claims_;
};

// Sets map_error_m, map_error_rad and map_nees: the final map against T_camera(start)_object.
void evaluateMap(const ObjectEstimate& estimate, const SE3& T_start_object,
                 const Symmetries& symmetries, ObjectMetrics& metrics);

}  // namespace diorama
