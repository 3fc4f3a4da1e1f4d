// The start, until there is a map that may be told of: corners are followed (initialisation), or
// lie on known objects (surface_start); what begins so is on trial (start_trial).
#pragma once

#include <span>

#include "core/measurements.h"
#include "vo/initialisation.h"
#include "vo/object_surfaces.h"
#include "vo/start_trial.h"

namespace diorama::vo {

enum class Verdict { kOpen, kConfirmed, kRefuted };

class Start {
 public:
  // All three must outlive it.
  Start(const Camera& camera, const VoOptions& options, const ObjectSurfaces& surfaces)
      : camera_(camera),
        options_(options),
        surfaces_(surfaces),
        initialisation_(camera, options, surfaces),
        trial_(options) {}

  // Finds the corners in a frame.
  void follow(const TrackedFrame& frame);
  // Then, with enough parallax, fills the map and begins its trial. When the first keyframe led
  // nowhere and this frame was taken in its place, the attempt has a reason and did not start.
  StartAttempt attempt(const TrackedFrame& frame, std::span<const ObjectMeasurement> objects,
                       Map& map);
  // The last attempt that started.
  const StartAttempt& successful() const { return successful_; }

  // A scale that became known later puts the map on trial again.
  void beginTrial() { trial_.begin(); }
  // Of the map, by what is seen of objects from a pose in it; they say nothing of it unless `asked`
  // while the scale is learnt. A map that was right for some frames is no longer doubted: it may be
  // an object that moves.
  Verdict judge(const Map& map, const SE3& T_world_camera,
                std::span<const ObjectMeasurement> objects, bool asked);
  // From this frame.
  void beginAnew(const TrackedFrame& frame) { initialisation_.begin(frame, {}); }

 private:
  const Camera& camera_;
  const VoOptions& options_;
  const ObjectSurfaces& surfaces_;
  Initialisation initialisation_;
  StartTrial trial_;
  StartAttempt successful_;
  int frames_ = 0;
};

}  // namespace diorama::vo
