// What the image can show at all.
#pragma once

#include <algorithm>
#include <array>

#include "core/camera.h"
#include "core/mesh.h"
#include "core/se3.h"
#include "sim/ray_table.h"

namespace diorama {

// Of the bounding box, in the world.
inline std::array<Vector3d, 8> cornersOf(const Mesh& mesh, const SE3& T_world_object) {
  const Vector3d low = mesh.minCorner().cast<double>(), high = mesh.maxCorner().cast<double>();
  std::array<Vector3d, 8> corners;
  for (size_t k = 0; k < 8; ++k)
    corners[k] = T_world_object * Vector3d((k & 1 ? high : low).x(), (k & 2 ? high : low).y(),
                                           (k & 4 ? high : low).z());
  return corners;
}

// The planes through the camera's centre and the image's sides, as normals that point outwards.
class Frustum {
 public:
  explicit Frustum(const Camera& camera) {
    constexpr double kMargin_px = 8;
    const double x0 = -kMargin_px, x1 = camera.width() + kMargin_px, y0 = -kMargin_px,
                 y1 = camera.height() + kMargin_px;
    std::array<Vector3d, 4> rays;
    const std::array<Vector2d, 4> pixels = {Vector2d(x0, y0), Vector2d(x1, y0), Vector2d(x1, y1),
                                            Vector2d(x0, y1)};
    for (size_t k = 0; k < 4; ++k) rays[k] << extendedDirection(camera, pixels[k]), 1;
    for (size_t k = 0; k < 4; ++k) normals_[k] = rays[(k + 1) % 4].cross(rays[k]).normalized();
  }

  bool misses(const SE3& T_world_camera, const std::array<Vector3d, 8>& corners) const {
    const SE3 T_camera_world = T_world_camera.inverse();
    return std::any_of(normals_.begin(), normals_.end(), [&](const Vector3d& n) {
      return std::all_of(corners.begin(), corners.end(),
                         [&](const Vector3d& p) { return n.dot(T_camera_world * p) > 0; });
    });
  }

 private:
  std::array<Vector3d, 4> normals_;
};

}  // namespace diorama
