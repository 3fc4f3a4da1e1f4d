// The graph's variables and factors, in plain lists.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "mapper/object_factor.h"
#include "mapper/odometry_factor.h"

namespace diorama {

struct PoseNode {
  SE3 T_world_camera;
  int64_t timestamp_ns = 0;
  std::vector<ObjectFactor> objects;  // seen from here
};

// Or the scale of an odometry (odometry_factor.h): s is the first number of the translation, the
// others are nothing.
struct ObjectNode {
  std::string name;
  SE3 T_world_object;
};

struct Graph {
  std::deque<PoseNode> poses;           // the first is fixed
  std::deque<OdometryFactor> odometry;  // [k] between poses k and k + 1
  std::vector<ObjectNode> objects;
  RobustKernel object_kernel, odometry_kernel;
};

}  // namespace diorama
