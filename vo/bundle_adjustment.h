// Local bundle adjustment: the newest keyframes, the points that they see, and the objects that
// give the map its scale, together.
#pragma once

#include "vo/map.h"
#include "vo/vo_options.h"

namespace diorama::vo {

struct BundleRequest {
  int window = 8;      // newest keyframes that move; the map's first one never does
  int iterations = 6;  // Levenberg-Marquardt steps
  bool metric =
      true;  // objects count; else the map's scale is arbitrary, and held by its second keyframe
  // Random walk of the velocity between keyframes that follow one another, m^2/s^3 (see
  // MotionModel); 0: nothing is assumed of the motion.
  double acceleration = 0;
};

struct BundleReport {
  int keyframes = 0, points = 0, observations = 0;
  int dropped = 0;                         // observations that did not agree
  double cost_before = 0, cost_after = 0;  // robust, half of the whitened squares
};

// Minimises  sum rho(|covariance^-1/2 (u - project(T_camera_world p))|^2) + sum rho(r^T information
// r)  with r = Log(Z^-1 T_world_camera^-1 T_world_object), over T_world_camera of the window,
// T_world_object, p. Points are eliminated by the Schur complement. Older keyframes hold their
// points with fixed poses. A step that is not finite or does not lower the cost is not taken.
BundleReport adjustBundle(const Camera& camera, Map& map, const BundleRequest& request,
                          const VoOptions& options);

}  // namespace diorama::vo
