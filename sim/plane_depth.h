// Depth on a triangle's plane in double precision: what single-precision traversal finds is off by
// some 1e-6 of the distance, and more at grazing angles.
#pragma once

#include <Eigen/Geometry>
#include <cmath>

#include "sim/render_scene.h"
#include "sim/row_cameras.h"

namespace diorama {

class PlaneDepth {
 public:
  explicit PlaneDepth(const RenderScene& scene) : scene_(scene) {}

  // Along the direction (x, y, 1) of the camera.
  float operator()(const CameraFrame& camera, uint32_t triangle, float x, float y,
                   float traversal_t) {
    setTriangle(camera, triangle);
    const double along = n_camera_.x() * static_cast<double>(x) +
                         n_camera_.y() * static_cast<double>(y) + n_camera_.z();
    const double t = height_ / along;
    // Seen edge-on the plane says nothing.
    if (!(std::abs(t - static_cast<double>(traversal_t)) <=
          1e-3 * static_cast<double>(traversal_t)))
      return traversal_t;
    return static_cast<float>(t);
  }

 private:
  void setTriangle(const CameraFrame& camera, uint32_t triangle) {
    if (triangle == triangle_ && &camera == camera_) return;
    triangle_ = triangle;
    camera_ = &camera;
    const Vector3d p0 = scene_.corner(triangle, 0).cast<double>();
    const Vector3d n = (scene_.corner(triangle, 1).cast<double>() - p0)
                           .cross(scene_.corner(triangle, 2).cast<double>() - p0);
    height_ = n.dot(p0 - camera.origin);
    n_camera_ = camera.R.transpose() * n;
  }
  const RenderScene& scene_;
  const CameraFrame* camera_ = nullptr;
  uint32_t triangle_ = UINT32_MAX;
  Vector3d n_camera_ = Vector3d::Zero();
  double height_ = 0;
};

}  // namespace diorama
