// The mapper's belief at one time.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/se3.h"

namespace diorama {

struct ObjectEstimate {
  std::string name;
  SE3 T_world_object;                          // the world is the camera frame of the first pose
  Matrix6d covariance = Matrix6d::Identity();  // marginal, right tangent [rho, phi]
};

struct MapEstimate {
  int64_t timestamp_ns = 0;
  SE3 T_world_camera;  // of the newest pose
  std::vector<ObjectEstimate> objects;
};

}  // namespace diorama
