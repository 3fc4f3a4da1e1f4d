// The camera's motion: smooth poses as a function of time.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/se3.h"

namespace diorama {

class CameraPath {
 public:
  virtual ~CameraPath() = default;
  // T_world_camera at a time in seconds; constant before the start and after the end.
  virtual SE3 pose(double time_s) const = 0;
};

struct Keyframe {
  double time_s = 0;
  SE3 T_world_camera;
};

// The pose of a camera at `position` that looks at `target` with the world's z upwards in the
// image.
SE3 lookAt(const Vector3d& position, const Vector3d& target);

// A cumulative cubic B-spline-like interpolation through the keyframes, C2 in SE(3).
// At least one keyframe, times strictly increasing.
std::unique_ptr<CameraPath> makeSplinePath(const std::vector<Keyframe>& keyframes);

struct Orbit {
  Vector3d center = Vector3d::Zero();  // looked at, m
  double radius_m = 0.8;               // horizontal distance from the centre
  double height_m = 0.4;               // above the centre
  double start_rad = 0;                // azimuth, 0 = +x, counter-clockwise from above
  double rate_rad_s = 0.5;
};
std::unique_ptr<CameraPath> makeOrbitPath(const Orbit& orbit);

}  // namespace diorama
