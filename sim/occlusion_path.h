// The way of an occluder, between the camera and the object that it hides.
#pragma once

#include <vector>

#include "sim/occlusion.h"

namespace diorama {

// An occluder stands across the line from the camera to the object's middle and slides towards and
// away from it.
struct OccluderLane {
  double distance_m = 0.3;  // from the camera, along that line
  double side_rad = 0;      // where it comes from
};

// T_world_occluder; slide_m = 0: its middle is on the line, above 0: on the side it comes from.
SE3 occluderPose(const OccluderKind& kind, const OccluderLane& lane, const Vector3d& camera,
                 const Vector3d& object, double slide_m);

// Slides at the frames first, first + 1, ...; before and after it is put away.
struct OccluderTrack {
  OccluderLane lane;
  int first = 0;
  std::vector<double> slide_m;
};

// The same over time, smooth between the frames. Away means below everything, or, where there is no
// room, behind the camera. `object` is hidden, at `object_middle` in its frame; `scene` lends its
// times and camera.
MotionPathPtr makeOccluderPath(const OccluderKind& kind, const OccluderTrack& track,
                               const Scene& scene, const SceneObject& object,
                               const Vector3d& object_middle);

}  // namespace diorama
