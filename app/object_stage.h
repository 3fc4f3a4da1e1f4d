// One object's tracker, frame by frame: when it is started anew, and from where.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/pipeline_types.h"
#include "core/frame.h"
#include "core/object_detector.h"

namespace diorama {

// What the map says of an object to its tracker.
struct Guidance {
  bool track = true;                                // in vo only while the odometry wants objects
  bool placed = false;                              // in vo: it need not be found again
  int rejected = 0;                                 // claimed, but outside the gate: in a row
  int missed_frames = 0;                            // not heard of: in a row
  bool overdue = false;                             // not heard of for too long
  bool moving = false;                              // in the world: says nothing of the camera
  std::optional<ObjectPrediction> prediction = {};  // where it is in the frame; fused
};

// What the tracker says of a frame.
struct Sighting {
  size_t object = 0;
  int64_t timestamp_ns = 0;
  std::optional<ObjectMeasurement> measurement;  // none when nobody wanted one
  std::optional<StampedPose> start;              // the newest T_camera_object it started from
  bool doubt = false;                            // it was found where the map is to give way
  std::vector<Event> events;
  double ms = 0;
};

class ObjectStage {
 public:
  // `detected`: there is a detector, which may find the object.
  ObjectStage(PipelineObject parts, size_t number, Method method, bool detected,
              const PipelineOptions& options);

  // Whether the next frame can be measured without asking the map, or anybody, for a start.
  bool isHeld(const Guidance& guidance) const;
  // Whether the object has no prediction, or a vague one, or one that has led to nothing for long;
  // and whether it is to be looked for in the next frame.
  bool isMissing(const Guidance& guidance) const;
  bool isWanted(const Guidance& guidance) const;

  // Starts anew from what was detected in this frame, or else from the initial pose in the first
  // frame, or from the prediction after a frame in which the tracker did not hold the object;
  // otherwise the tracker goes on by itself.
  Sighting track(const Frame& frame, const Guidance& guidance,
                 const std::optional<Detection>& detection);

 private:
  bool isClaimedInVain(const Guidance& guidance) const;
  bool isVague(const ObjectPrediction& prediction) const;
  std::optional<ObjectPrediction> findStart(const Guidance& guidance,
                                            const std::optional<Detection>& detection,
                                            Sighting& sighting) const;
  void noteChange(const ObjectMeasurement& measurement, Sighting& sighting) const;
  void note(Sighting& sighting, const char* event, double value, std::string reason) const;

  PipelineObject parts_;
  size_t number_;
  Method method_;
  bool detected_;
  PipelineOptions options_;
  bool first_ = true;      // no frame yet
  bool begun_ = false;     // it was given a start
  bool claimed_ = false;   // in the last frame
  bool was_lost_ = false;  // at any time since it begun
};

}  // namespace diorama
