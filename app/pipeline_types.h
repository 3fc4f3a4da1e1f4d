// What goes into the pipeline and comes out of it.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/map_estimate.h"
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
  int64_t timestamp_ns = 0;  // of the frame
  std::optional<OdometryMeasurement> odometry;
  // The world is the camera frame of the first frame that has a pose; none before it, nor in ebt.
  std::optional<SE3> T_world_camera;
  // Of the world of the odometry in that of the map, as it drifts; fused.
  std::optional<SE3> T_world_odometry;
  std::vector<ObjectResult> objects;  // in the order of the pipeline's objects
  std::vector<Event> events;
  bool dropped = false;  // by a stage that was behind
  double odometry_ms = 0, tracker_ms = 0, mapper_ms = 0;
};

struct PipelineObject {
  std::string name;
  std::unique_ptr<ObjectTracker> tracker;  // not needed in vo, unless the odometry wants objects
  // In the first processed frame; without it the detector must find the object.
  std::optional<SE3> initial_T_camera_object;
  Symmetries symmetries = {};
};

// Everything with hindsight (fused; otherwise what is known).
struct FinalEstimate {
  Trajectory camera;
  MapEstimate map;
};

// How much later than the picture a measurement reaches the map, in the time of the pictures:
// asynchrony that is repeatable. Lock-step only; in real time it takes what it takes.
struct LatencyOptions {
  double tracker = 0;
  double odometry = 0;
  template <class V>
  void visit(V& v) {
    v("tracker", tracker, kNotNegative);
    v("odometry", odometry, kNotNegative);
  }
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
  // a tracker's errors are alike over many frames (measured: a mean map_nees of 5.6 over the
  // first 100 frames of 20 carton seeds).
  double object_sigma_scale_with_vo = 2.2;
  // The mapper's odometry_memory_s beside `vo`, where that is 0. Measured: about 1 s on most
  // sequences, 3 to 6 s on the free carton and bottle. Of 1 to 3 s chosen by the figures of the
  // sequences of ADR 32: the shorter, the better the camera and the worse carton and map_nees.
  double odometry_memory_with_vo_s = 3;
  // The mapper's odometry_scale_sigma beside `vo`, where that is 0: what two to eight keyframes
  // with the poses of an object leave open (measured on rendered desks: 1.2 to 0.3%).
  double odometry_scale_sigma_with_vo = 0.003;
  LatencyOptions latency_s;
  // In real time: frames that may wait for a stage; then the oldest is dropped.
  int queue_frames = 4;
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
    v("odometry_memory_with_vo_s", odometry_memory_with_vo_s, kNotNegative);
    v("odometry_scale_sigma_with_vo", odometry_scale_sigma_with_vo, kNotNegative);
    v("latency_s", latency_s);
    v("queue_frames", queue_frames, Range{1, 1000});
  }
};

struct PipelineParts {
  Method method = Method::kFused;
  std::vector<PipelineObject> objects;
  std::unique_ptr<Odometry> odometry;        // not needed in ebt
  std::unique_ptr<ObjectDetector> detector;  // its objects are numbered as these; or none
  MapperOptions mapper;
  PipelineOptions options;
};

}  // namespace diorama
