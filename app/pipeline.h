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
#include "core/object_detector.h"
#include "core/object_model.h"
#include "core/object_tracker.h"
#include "core/odometry.h"
#include "core/options.h"
#include "core/trajectory.h"
#include "mapper/mapper.h"

namespace diorama {

// vo: odometry alone carries the object (one that wants objects is told of them); ebt: the tracker
// alone; fused: both and the graph, with feedback.
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
  // The world is the camera frame of the first frame that has a pose; none before it, nor in ebt.
  std::optional<SE3> T_world_camera;
  std::vector<ObjectResult> objects;  // in the order of the pipeline's objects
  std::vector<Event> events;
  double odometry_ms = 0, tracker_ms = 0, mapper_ms = 0;
};

struct PipelineObject {
  std::string name;
  std::unique_ptr<ObjectTracker> tracker;  // not needed in vo, unless the odometry wants objects
  // In the first processed frame; without it the detector must find the object.
  std::optional<SE3> initial_T_camera_object;
  Symmetries symmetries = {};
};

struct PipelineOptions {
  // With the graph's prediction a tracker is restarted from that; an object that the graph did not
  // hear of for so many frames, or seconds, is looked for anew (Singhal et al. 2016: 500 frames).
  int redetect_after_frames = 500;
  double redetect_after_s = 1.5;
  // So is one whose predicted place is known no better than this (one sigma of the worst
  // direction), as after a gap in the odometry: what the contract calls lost.
  double redetect_above_m = 0.05;
  double redetect_above_rad = 0.087;
  int search_every_frames = 1;  // while an object is looked for
  // A tracker that claims its object is restarted when the graph has rejected it so many times in a
  // row: by then the measurements would have made a place of their own, had they agreed.
  int reset_after_rejected = 3;
  // The map begins with the odometry, or after this time without it.
  double odometry_wait_s = 3;
  // Beside `vo` standard deviations of objects are multiplied with this, on top of the mapper's own
  // scale: the odometry has a map and its errors do not add up as those of its steps would, while
  // a tracker's errors are alike over many frames (measured: a map_nees of 8 instead of 190).
  double object_sigma_scale_with_vo = 5;
  template <class V>
  void visit(V& v) {
    v("redetect_after_frames", redetect_after_frames, Range{0, 1000000000});
    v("redetect_after_s", redetect_after_s, kNotNegative);
    v("redetect_above_m", redetect_above_m, kPositive);
    v("redetect_above_rad", redetect_above_rad, kPositive);
    v("search_every_frames", search_every_frames, Range{1, 1000000});
    v("reset_after_rejected", reset_after_rejected, Range{1, 1000000});
    v("odometry_wait_s", odometry_wait_s, kNotNegative);
    v("object_sigma_scale_with_vo", object_sigma_scale_with_vo, kPositive);
  }
};

class Pipeline {
 public:
  // `odometry` is not needed in ebt; the detector, whose objects are numbered as these, only where
  // one has no initial pose. With a detector lost objects are looked for, too.
  Pipeline(Method method, std::vector<PipelineObject> objects, std::unique_ptr<Odometry> odometry,
           const MapperOptions& mapper_options, std::unique_ptr<ObjectDetector> detector = nullptr,
           const PipelineOptions& options = {});

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
    bool begun = false;                      // it was given a start
    bool claimed = false;                    // in the last frame
    bool was_lost = false;                   // at any time since it begun
    int rejected = 0;                        // claimed, but outside the gate: in a row
    int missed_frames = 0;                   // not heard of: in a row
    std::optional<int64_t> heard_ns = {};    // the last time it was
    bool overdue = false;                    // not heard of for too long
    std::optional<SE3> T_world_object = {};  // where its start put it; vo
  };
  using Starts = std::vector<std::optional<ObjectPrediction>>;  // one per object

  void moveCamera(const Frame& frame, FrameResult& result);
  void measureObjects(const Frame& frame, FrameResult& result);
  void informOdometry(FrameResult& result);
  SE3 guessedStep(const FrameResult& result) const;
  void moveMap(FrameResult& result);
  SE3 poseAt(int64_t timestamp_ns) const;
  bool startMap();
  void updateMap(FrameResult& result);
  void reportObjects(FrameResult& result) const;
  Starts findStarts(const Frame& frame, FrameResult& result);
  std::optional<ObjectPrediction> predict(const Object& object) const;
  std::optional<SE3> carriedByOdometry(const Object& object) const;
  bool isWanted(const Object& object) const;
  void noteHeard(Object& object) const;
  void noteAbsences(FrameResult& result);
  bool isVague(const ObjectPrediction& prediction) const;
  void detect(const Frame& frame, const std::vector<int>& wanted, Starts& starts,
              FrameResult& result);
  void noteChange(Object& object, const ObjectMeasurement& measurement, FrameResult& result) const;

  Method method_;
  std::vector<Object> objects_;
  std::unique_ptr<Odometry> odometry_;
  Mapper mapper_;
  std::unique_ptr<ObjectDetector> detector_;
  PipelineOptions options_;
  SE3 T_world_camera_;  // by odometry alone
  Trajectory camera_;
  bool started_ = false;
  bool odometry_gap_ = false;  // the last frame's motion did not enter the map
  std::optional<int64_t> first_ns_;
  int64_t now_ns_ = 0;
};

}  // namespace diorama
