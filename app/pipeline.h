// Where the modules meet: each frame goes to the odometry and the trackers, their measurements to
// the mapper, and the mapper's prediction back to a tracker that lost its object (the paper's
// Algorithm 1). It never sees ground truth.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/errors.h"
#include "core/frame.h"
#include "core/object_tracker.h"
#include "core/odometry.h"
#include "core/trajectory.h"
#include "mapper/mapper.h"

namespace diorama {

// vo: odometry alone carries the object; ebt: the tracker alone; fused: both and the graph, with
// feedback.
enum class Method { kVo, kEbt, kFused };

struct Event {
  int64_t timestamp_ns = 0;
  std::string source;
  std::string event;
  double value = 0;
  std::string reason;
};

struct ObjectResult {
  std::optional<ObjectMeasurement> measurement;  // the tracker's own output; none in vo
  std::optional<SE3> T_camera_object;            // the method's best estimate now, no hindsight
};

struct FrameResult {
  std::optional<OdometryMeasurement> odometry;
  std::optional<SE3>
      T_world_camera;  // the world is the camera frame of the first processed frame; none in ebt
  std::vector<ObjectResult> objects;  // in the order of the pipeline's objects
  std::vector<Event> events;
  double odometry_ms = 0, tracker_ms = 0, mapper_ms = 0;
};

struct PipelineObject {
  std::string name;
  std::unique_ptr<ObjectTracker> tracker;  // not needed in vo
  SE3 initial_T_camera_object;             // in the first processed frame
};

class Pipeline {
 public:
  // `odometry` is not needed in ebt.
  Pipeline(Method method, std::vector<PipelineObject> objects, std::unique_ptr<Odometry> odometry,
           const MapperOptions& mapper_options);

  // Frames in the order of their time stamps.
  FrameResult process(const Frame& frame);

  // After the last frame: everything with hindsight (fused; otherwise what is known).
  struct Final {
    Trajectory camera;
    MapEstimate map;
  };
  Final finish();

 private:
  struct Object {
    PipelineObject parts;
    bool claimed = false;   // in the last frame
    bool was_lost = false;  // at any time
  };

  void moveCamera(const Frame& frame, FrameResult& result);
  void measureObjects(const Frame& frame, FrameResult& result);
  void updateMap(FrameResult& result);
  void reportObjects(FrameResult& result) const;
  std::optional<ObjectPrediction> startOf(const Object& object, FrameResult& result) const;
  void noteChange(Object& object, const ObjectMeasurement& measurement, FrameResult& result) const;

  Method method_;
  std::vector<Object> objects_;
  std::unique_ptr<Odometry> odometry_;
  Mapper mapper_;
  SE3 T_world_camera_;  // by odometry alone
  Trajectory camera_;
  bool started_ = false;
  int64_t now_ns_ = 0;
};

}  // namespace diorama
