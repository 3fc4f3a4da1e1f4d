// What the sensors and trackers say, with covariances in the right tangent of the measured pose,
// [rho, phi], m and rad.
#pragma once

#include <cstdint>
#include <string>

#include "core/se3.h"

namespace diorama {

struct OdometryMeasurement {
  std::string source;  // name of the odometry
  int64_t from_ns = 0;
  int64_t to_ns = 0;
  SE3 T_from_to;  // camera(from) <- camera(to)
  Matrix6d covariance = Matrix6d::Identity();
  double health = 0;  // in [0, 1]; 0 = no measurement
  // The odometry has not learnt its scale yet: T_from_to is as it sees it, its lengths times a
  // factor that nobody knows, the same in all such steps. The covariance says nothing of that.
  bool up_to_scale = false;

  // For who takes each step by itself: a length may be half as long or twice.
  Matrix6d covarianceWithScale() const;
};

struct ObjectMeasurement {
  std::string source;  // name of the tracker
  std::string object;
  int64_t timestamp_ns = 0;
  SE3 T_camera_object;
  Matrix6d covariance = Matrix6d::Identity();
  double health = 0;     // in [0, 1]
  bool claimed = false;  // the tracker says that it holds the object in this frame
  std::string reason;    // why it is not claimed; empty when it is
};

// Where an object is expected.
struct ObjectPrediction {
  SE3 T_camera_object;
  Matrix6d covariance = Matrix6d::Identity();
  bool verified = false;  // there is other evidence for it than the tracker's own
  // Its covariance tells what is known beside the images that the tracker has seen: a detection's,
  // or of a pose that was given.
  bool independent = false;
};

}  // namespace diorama
