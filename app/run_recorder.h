// Writes a run directory: what was estimated, measured and decided, and how good it was. Only here
// do estimates meet truth.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "app/event_log.h"
#include "app/growing_files.h"
#include "app/pipeline_types.h"
#include "core/ground_truth.h"
#include "core/object_model.h"
#include "eval/metrics.h"
#include "eval/object_errors.h"

namespace diorama {

// What is known of an object in a frame, and how good its reported pose is.
struct JudgedObject {
  std::optional<SE3> truth;        // T_camera_object
  std::optional<PoseError> error;  // of what is reported
  std::optional<double> visible_fraction;
};

class RunRecorder {
 public:
  // The folder must be there.
  RunRecorder(Method method, std::vector<ObjectModel> objects, std::filesystem::path folder);
  RunRecorder(const RunRecorder&) = delete;
  RunRecorder& operator=(const RunRecorder&) = delete;

  // One processed frame; `number` is its number in the scene or sequence. Throws OutputError.
  void add(int number, int64_t timestamp_ns, const FrameResult& result,
           const std::optional<GroundTruth>& truth);

  // The objects in the newest frame.
  const std::vector<JudgedObject>& judged() const { return judged_; }

  // Completes everything but metrics.json; without it nothing is left. Throws OutputError.
  void finish(const FinalEstimate& final);

  // Everything but what concerns the run as a whole (scene, seed, time, memory).
  Metrics metrics(const FinalEstimate& final) const;

 private:
  void begin();
  void judge(const FrameResult& result, const std::optional<GroundTruth>& truth);
  void addOdometry(const std::string& prefix, const FrameResult& result,
                   const std::optional<GroundTruth>& truth);
  void addObject(size_t index, const std::string& prefix, int64_t timestamp_ns,
                 const ObjectResult& result);
  CameraMetrics cameraMetrics() const;

  Method method_;
  std::vector<ObjectModel> models_;
  GrowingFiles files_;
  Trajectory camera_online_, camera_truth_;
  std::vector<ObjectEvaluation> evaluations_;  // per object
  std::vector<JudgedObject> judged_;
  std::optional<SE3> first_camera_truth_;       // of the first frame with an estimate
  std::vector<std::optional<SE3>> last_truth_;  // T_world_object; some objects move
  std::vector<int> reinitialisations_;
  std::vector<double> odometry_nees_;
  std::optional<int> start_frame_;  // number of the first frame with an estimate
  int frames_ = 0, frames_since_start_ = 0, healthy_frames_ = 0;
  double odometry_ms_ = 0, tracker_ms_ = 0, mapper_ms_ = 0;
  EventLog events_;
};

}  // namespace diorama
