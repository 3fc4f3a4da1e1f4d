// Finds known objects in one image, without any idea of where they are.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/frame.h"
#include "core/se3.h"

namespace diorama {

struct Detection {
  SE3 T_camera_object;
  double health = 0;  // in [0, 1]: how well the image's edges agree with the pose
  std::optional<double> look =
      {};           // in [-1, 1]: how well its grey values do; nothing for a plain object
  int inliers = 0;  // features that agree with it; 0 when it was found by its edges
  // Of the pose (right tangent, m and rad), by what its features alone say; without any, 1 m, 1
  // rad.
  Matrix6d covariance = Matrix6d::Identity();
};

class ObjectDetector {
 public:
  virtual ~ObjectDetector() = default;

  // Looks for the objects with the given numbers; one result each, nothing where it is not found.
  // What is returned was verified. The same frame gives the same result.
  virtual std::vector<std::optional<Detection>> detect(const Frame& frame,
                                                       std::span<const int> objects) = 0;
};

}  // namespace diorama
