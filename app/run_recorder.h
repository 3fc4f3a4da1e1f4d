// Writes a run directory: what was estimated, measured and decided, and how good it was. Only here
// do estimates meet truth.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/event_log.h"
#include "app/pipeline_types.h"
#include "core/ground_truth.h"
#include "core/object_model.h"
#include "eval/metrics.h"
#include "eval/object_errors.h"

namespace diorama {

class RunRecorder {
 public:
  RunRecorder(Method method, std::vector<ObjectModel> objects);

  // One processed frame; `number` is its number in the scene or sequence.
  void add(int number, int64_t timestamp_ns, const FrameResult& result,
           const std::optional<GroundTruth>& truth);

  // True T_camera_object of an object in the newest frame, and its error there; nothing when not
  // known.
  std::optional<SE3> truth(size_t object) const;
  std::optional<double> error_m(size_t object) const;

  // Writes everything but metrics.json; throws OutputError.
  void write(const std::filesystem::path& folder, const FinalEstimate& final) const;

  // Everything but what concerns the run as a whole (scene, seed, time, memory).
  Metrics metrics(const FinalEstimate& final) const;

 private:
  void addOdometry(const std::string& prefix, const FrameResult& result,
                   const std::optional<GroundTruth>& truth);
  void addObject(size_t index, const std::string& prefix, const ObjectResult& result);
  CameraMetrics cameraMetrics() const;

  Method method_;
  std::vector<ObjectModel> models_;
  Trajectory camera_online_, camera_truth_, odometry_world_;
  std::vector<Trajectory> object_paths_;
  std::vector<std::vector<ObjectFrame>> object_frames_;  // per object
  std::optional<SE3> first_camera_truth_;                // of the first frame with an estimate
  std::vector<std::optional<SE3>> last_truth_;           // T_world_object; some objects move
  std::vector<int> reinitialisations_;
  std::vector<OdometryFrame> odometry_frames_;
  std::optional<int> start_frame_;  // number of the first frame with an estimate
  int frames_ = 0, frames_since_start_ = 0, healthy_frames_ = 0;
  double odometry_ms_ = 0, tracker_ms_ = 0, mapper_ms_ = 0;
  std::string frames_csv_, measurements_csv_;
  EventLog events_;
};

}  // namespace diorama
