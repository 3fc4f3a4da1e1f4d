// How the camera or an object moves: smooth poses as a function of time.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

#include "core/se3.h"
#include "core/trajectory.h"

namespace diorama {

class MotionPath {
 public:
  virtual ~MotionPath() = default;
  // T_world_camera or T_world_object at a time in seconds, also before and after what is scripted.
  // Thread-safe.
  virtual SE3 pose(double time_s) const = 0;
};
using MotionPathPtr = std::shared_ptr<const MotionPath>;

struct Keyframe {
  double time_s = 0;
  SE3 pose;
};

// The pose of a camera at `position` that looks at `target` with the world's z upwards in the
// image, then turned by roll_rad about the line of sight (T * rotation about the camera's +z). A
// camera that looks straight up or down has the world's +y upwards in the image. The two points
// must differ.
SE3 lookAt(const Vector3d& position, const Vector3d& target, double roll_rad = 0);

// From 0 to 1 with no velocity and no acceleration at either end, as a hand moves from rest to rest
// (T. Flash, N. Hogan, The coordination of arm movements, J. Neurosci. 1985); clamped.
double minimumJerk(double fraction);

// A path through the keyframes, C2 in SE(3): cubic splines with knots at the keyframes' times and
// natural ends, for the position in R^3 and for the rotation as a cumulative B-spline on SO(3)
//   R(t) = C_i Exp(b1(t) w_i+1) Exp(b2(t) w_i+2) Exp(b3(t) w_i+3),   w_j = Log(C_j-1^-1 C_j)
// (M.-J. Kim, M.-S. Kim, S. Y. Shin, A general construction scheme for unit quaternion curves,
// SIGGRAPH 1995), whose control rotations C are solved for so that it passes through the keyframes.
// It rests before the first and after the last one, and between equal neighbours, where the motion
// before ends and the one after begins with no velocity. At least one keyframe, times strictly
// increasing; a programming error otherwise.
std::unique_ptr<MotionPath> makeSplinePath(const std::vector<Keyframe>& keyframes);

// Paths whose position and orientation are given apart.
using PointOverTime = std::function<Vector3d(double time_s)>;
// The orientation of something at `position`.
using Aim = std::function<Eigen::Quaterniond(double time_s, const Vector3d& position)>;
std::unique_ptr<MotionPath> makeAimedPath(PointOverTime position, Aim aim);

Aim aimFixed(const Eigen::Quaterniond& rotation);
// A camera's, as lookAt; within a micrometre of the target it looks along the world's x axis.
Aim aimAt(PointOverTime target, double roll_rad = 0);

// A sum of sines.
struct Swing {
  double amplitude = 0;
  double period_s = 1;
};
using Swings = std::vector<Swing>;

struct Orbit {
  Vector3d center = Vector3d::Zero();  // m
  double radius_m = 0.8;               // horizontal distance from the centre
  double height_m = 0.4;               // above the centre
  double start_rad = 0;                // azimuth, 0 = +x, counter-clockwise from above
  double rate_rad_s = 0.5;
  Swings azimuth_swing, radius_swing, height_swing;  // added, rad and m
};
PointOverTime onOrbit(const Orbit& orbit);

// Straight from one point to another between two times, by minimumJerk.
PointOverTime onDolly(const Vector3d& from, const Vector3d& to, double start_s, double end_s);

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

// Paths one after the other, each in its own time from 0 on. Between the end of one and the start
// of the next the motion passes over in join_s, C1: positions and rotations, each continued with
// the velocity it has at the joint, are blended by minimumJerk. Two rests with a short join are a
// saccade.
struct Segment {
  MotionPathPtr path;
  double duration_s = 1;  // at least 1 ms
  double join_s = 0.5;    // into the next segment, at least 1 ms; the last one's does not matter
};
std::unique_ptr<MotionPath> makeSequencePath(const std::vector<Segment>& segments);

// The tremor of a hand, added to a path on the right: in each of the six components a sum of sines
// with frequencies spread over the band, all with the same velocity (amplitude ~ 1 / frequency).
struct Shake {
  double amplitude_m = 0.003;  // root mean square, per axis
  double amplitude_rad = 0.005;
  double low_hz = 0.5;
  double high_hz = 8;
  uint64_t seed = 1;
};
std::unique_ptr<MotionPath> makeShakenPath(MotionPathPtr path, const Shake& shake);

// A look away and back: from start_s to end_s the camera turns towards another point, in turn_s
// at either end, by minimumJerk.
struct Glance {
  double start_s = 0, end_s = 1;
  double turn_s = 0.5;
  PointOverTime target;
};
std::unique_ptr<MotionPath> makeGlancingPath(MotionPathPtr path,
                                             const std::vector<Glance>& glances);

}  // namespace diorama
