// Whether an object moves, by itself, in the world.
//
// The camera's way by odometry alone carries what was measured of an object from frame to frame.
// An object moves when that says, for several frames in a row, that it is elsewhere than a window
// ago: farther than can be explained by odometry and tracker, on a way without jumps, by a tracker
// that is as healthy as it was before, and while another object that is seen stays where it is.
// A tracker that slips jumps, or its health falls; odometry that errs moves everything at once.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/measurements.h"
#include "core/object_model.h"
#include "core/options.h"

namespace diorama {

struct MotionOptions {
  bool watch = true;  // otherwise all objects are static
  double window_s = 0.5;
  // An object has moved by more than this within a window, and by more than so many sigmas.
  double least_m = 0.015;
  double least_rad = 0.06;
  double sigmas = 4;
  double odometry_scale = 0.02;  // what the odometry's scale may be wrong by, one sigma
  int frames = 5;                // in a row
  double largest_step = 0.34;    // of the way, between two frames
  double health_share = 0.8;     // of the tracker's usual health
  // It rests again when all that was measured for so long lies within this and two sigmas.
  double rest_s = 1;
  double rest_m = 0.004;
  double rest_rad = 0.02;
  // Constant velocity: how much that changes in a second, one sigma (a hand that pushes).
  double accel_m_s2 = 0.3;
  double accel_rad_s2 = 1.5;
  // An object that is not seen slows down: its velocity falls to a third in this time.
  double coast_s = 0.5;

  template <class V>
  void visit(V& v) {
    v("watch", watch);
    v("window_s", window_s, kPositive);
    v("least_m", least_m, kPositive);
    v("least_rad", least_rad, kPositive);
    v("sigmas", sigmas, kPositive);
    v("odometry_scale", odometry_scale, kNotNegative);
    v("frames", frames, Range{1, 1000});
    v("largest_step", largest_step, kFraction);
    v("health_share", health_share, kFraction);
    v("rest_s", rest_s, kPositive);
    v("rest_m", rest_m, kPositive);
    v("rest_rad", rest_rad, kPositive);
    v("accel_m_s2", accel_m_s2, kPositive);
    v("accel_rad_s2", accel_rad_s2, kPositive);
    v("coast_s", coast_s, kPositive);
  }
};

class MotionWatch {
 public:
  explicit MotionWatch(const MotionOptions& options) : options_(options) {}

  void setSymmetries(const std::string& object, const Symmetries& symmetries);

  void start(int64_t timestamp_ns);
  // The camera's next pose.
  void addStep(const OdometryMeasurement& step);
  // The camera's motion is not known: what was seen before is compared with nothing later.
  void breakOff(int64_t timestamp_ns);

  // A claimed measurement at a pose of the window; those of an object in the order of time.
  void addSight(const ObjectMeasurement& measurement);

  // After addSight(): whether it has moved, or has rested.
  bool moves(const std::string& object) const;
  bool rests(const std::string& object) const;
  // An object that is known to move says nothing about the others.
  void setMoving(const std::string& object, bool moving);

  // What was measured of it in the window, the oldest first.
  std::vector<ObjectMeasurement> window(const std::string& object) const;

 private:
  // The camera in the odometry's world; the variances have grown since its beginning.
  struct Camera {
    int64_t timestamp_ns = 0;
    SE3 T_world_camera;
    double variance_m2 = 0, variance_rad2 = 0;
  };
  struct Sight {
    Camera camera;
    ObjectMeasurement measurement;
    SE3 T_world_object;
  };
  // From one sight to another, and what is not known of it (sums over three directions).
  struct Way {
    double m = 0, rad = 0;
    double sigma_m = 0, sigma_rad = 0;
    double camera_m = 0;  // the camera's own
  };
  struct Watched {
    Symmetries symmetries;
    std::deque<Sight> sights;
    double health_sum = 0;
    int health_count = 0;
    std::optional<Way> way = {};  // within the newest window
    int displaced_frames = 0;
    bool moving = false;
  };

  const Camera* cameraAt(int64_t timestamp_ns) const;
  static Way wayBetween(const Sight& a, const Sight& b);
  std::optional<Way> wayInWindow(const Watched& object) const;
  bool isDisplaced(const Watched& object) const;
  size_t windowBegin(const Watched& object, double seconds) const;
  bool mayBeTheCamera(const std::string& object) const;

  MotionOptions options_;
  std::deque<Camera> path_;
  std::map<std::string, Watched> objects_;
};

}  // namespace diorama
