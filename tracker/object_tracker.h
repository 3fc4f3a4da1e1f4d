// Edge-based tracker of one known object (after Choi and Christensen 2012, with a direct start and
// texture patches): see object_tracker.cpp for the story of a frame.
#pragma once

#include <memory>
#include <string>

#include "core/camera.h"
#include "core/object_model.h"
#include "core/object_tracker.h"
#include "core/ray_query.h"
#include "tracker/tracker_options.h"

namespace diorama {

class EdgeTracker : public ObjectTracker {
 public:
  // The ray query holds the mesh of `model` as object number object_index_in_ray_query. Throws
  // InputError when no edge of the mesh can be seen from anywhere.
  EdgeTracker(ObjectModel model, Camera camera, std::shared_ptr<const RayQuery> rays,
              int object_index_in_ray_query, TrackerOptions options = {},
              std::string source_name = "edge");
  ~EdgeTracker() override;
  EdgeTracker(const EdgeTracker&) = delete;
  EdgeTracker& operator=(const EdgeTracker&) = delete;

  // Uses the grey values, and colours where edges are weak in them. A frame that does not fit the
  // camera, or in which the object is lost, is not claimed; its measurement holds the last pose,
  // and `reason` says why. Same input, same result. About 0.5 ms at 640 x 480.
  ObjectMeasurement track(const Frame& frame,
                          const std::optional<ObjectPrediction>& start) override;

  // What track() would say about this start, but nothing of it is kept.
  ObjectMeasurement examine(const Frame& frame, const ObjectPrediction& start);

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace diorama
