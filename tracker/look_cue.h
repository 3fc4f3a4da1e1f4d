// Moves a pose until the object looks in the image as it did in its training.
#pragma once

#include <vector>

#include "tracker/appearance.h"
#include "tracker/pose_solver.h"

namespace diorama {

// Differences between the image and one look, for the Gauss-Newton solver: of the logarithms that
// compareLooks() correlates. What the surface normals explain of them is light, and solved for in
// passing; things that cover the object count little.
class LookCue : public Cue {
 public:
  // All references must outlive this object; at most so many points are compared.
  LookCue(const DatabaseLook& look, const MeanImage& image, const Camera& camera,
          const Vector3d& centre_object, int most_points);

  CueEquations linearise(const SE3& T_camera_model) override;

 private:
  struct Point {
    Eigen::Vector4d light;          // unit normal, 1
    Vector3d residual;              // seen less known
    Eigen::Matrix<double, 3, 6> J;  // of the residual
  };
  bool measure(const SE3& T, const Matrix3d& R, size_t index, Point& out) const;
  Vector3d removeLight();

  const DatabaseLook& look_;
  const MeanImage& image_;
  const Camera& camera_;
  const Vector3d centre_object_;
  const size_t step_;
  std::vector<Point> points_;
};

}  // namespace diorama
