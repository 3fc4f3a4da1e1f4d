// Where the modules meet: each frame goes to the odometry and the trackers, their measurements to
// the mapper, and the mapper's prediction back to a tracker that lost its object (the paper's
// Algorithm 1). It never sees ground truth.
//
// This is the lock-step scheduler: everything is done with a frame before the next one is begun,
// and the result does not depend on how long anything takes. app/realtime_pipeline.h runs the same
// stages in real time.
#pragma once

#include <future>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "app/map_stage.h"
#include "app/pipeline_types.h"

namespace diorama {

class Pipeline {
 public:
  // Every object needs an initial pose or the detector. With a detector lost objects are looked
  // for, too.
  explicit Pipeline(PipelineParts&& parts);

  // Frames in the order of their time stamps; what is known by then of it and of earlier ones that
  // was not before: without latencies exactly this frame.
  std::vector<FrameResult> process(const Frame& frame);

  // After the last frame: what had not reached the map yet.
  std::vector<FrameResult> drain();
  FinalEstimate finish() { return map_.finish(); }

 private:
  void send(Message message, double latency_s);
  void arrive(int64_t now_ns);
  std::vector<std::future<Sighting>> beginHeld(const Frame& frame);
  std::vector<Sighting> measure(const std::vector<size_t>& objects, const Frame& frame);

  MapStage map_;
  std::optional<CameraStage> camera_;
  std::vector<ObjectStage> objects_;
  std::unique_ptr<ObjectDetector> detector_;
  LatencyOptions latency_s_;
  int64_t now_ns_ = 0;
  std::multimap<int64_t, Message> under_way_;  // by the time at which they reach the map
};

}  // namespace diorama
