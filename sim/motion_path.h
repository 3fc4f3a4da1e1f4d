// How the camera or an object moves: smooth poses as a function of time.
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "core/se3.h"
#include "core/trajectory.h"

namespace diorama {

class MotionPath {
 public:
  virtual ~MotionPath() = default;
  // T_world_camera or T_world_object at a time in seconds. A spline is constant before its first
  // and after its last keyframe. Thread-safe.
  virtual SE3 pose(double time_s) const = 0;
};

struct Keyframe {
  double time_s = 0;
  SE3 T_world_camera;
};

// The pose of a camera at `position` that looks at `target` with the world's z upwards in the
// image, then turned by roll_rad about the line of sight (T * rotation about the camera's +z). A
// camera that looks straight up or down has the world's +y upwards in the image. The two points
// must differ.
SE3 lookAt(const Vector3d& position, const Vector3d& target, double roll_rad = 0);

// A path through the keyframes, C2 in SE(3): cubic splines with knots at the keyframes' times and
// natural ends, for the position in R^3 and for the rotation as a cumulative B-spline on SO(3)
//   R(t) = C_i Exp(b1(t) w_i+1) Exp(b2(t) w_i+2) Exp(b3(t) w_i+3),   w_j = Log(C_j-1^-1 C_j)
// (M.-J. Kim, M.-S. Kim, S. Y. Shin, A general construction scheme for unit quaternion curves,
// SIGGRAPH 1995), whose control rotations C are solved for so that it passes through the keyframes.
// At least one keyframe, times strictly increasing; a programming error otherwise.
std::unique_ptr<MotionPath> makeSplinePath(const std::vector<Keyframe>& keyframes);

struct Orbit {
  Vector3d center = Vector3d::Zero();  // looked at, m
  double radius_m = 0.8;               // horizontal distance from the centre
  double height_m = 0.4;               // above the centre
  double start_rad = 0;                // azimuth, 0 = +x, counter-clockwise from above
  double rate_rad_s = 0.5;
};
std::unique_ptr<MotionPath> makeOrbitPath(const Orbit& orbit);

enum class RecordingFormat { kTum, kEuroc };

// The poses of a file, T_recorded_camera: TUM (seconds, t, q xyzw), or EuRoC's ground-truth CSV
// (nanoseconds, p, q wxyz, more columns are ignored), whose body frame is taken for the camera's.
// Throws MissingInputError or InputError with file:line.
Trajectory readRecording(const std::filesystem::path& file, RecordingFormat format);

// The recorded motion as a spline through all its poses, from time 0 on.
struct Placement {
  SE3 T_world_recorded;
  double time_scale = 1;  // 2 = twice as slow
  double scale = 1;       // of the recorded positions, before T_world_recorded
};
std::unique_ptr<MotionPath> makeRecordedPath(const Trajectory& recording,
                                             const Placement& placement);

}  // namespace diorama
