// A small square of a surface, and its search in images.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "core/camera.h"
#include "core/image.h"
#include "core/se3.h"

namespace diorama {

struct Patch {
  static constexpr int kRadius = 4;  // px
  static constexpr int kSide = 2 * kRadius + 1;
  static constexpr size_t kPixels = static_cast<size_t>(kSide) * kSide;
  static constexpr size_t kWhole = (kPixels + 7) / 8 * 8;  // whole vectors; zeros behind the end
  using Values = Eigen::Array<float, kWhole, 1>;

  // Grey values of the patch with its border of one pixel, row by row.
  static constexpr int kWindowSide = kSide + 2;
  using Window = std::array<float, static_cast<size_t>(kWindowSide) * kWindowSide>;

  Vector3d p, along_x, along_y;  // m, model frame: centre, and one pixel to the right and down
  Values grey, gradient_x, gradient_y;  // grey without its mean
  Matrix2d inverse_hessian;
  float norm = 0;  // of grey
  // In the current image:
  bool expected = false, found = false;
  Vector2d u_px;
  double distance_px = 0;

  // Of the plane with this point and normal. False where it is seen edge-on.
  bool setPlane(const Vector3d& p_model, const Vector3d& normal, const Camera& camera,
                const SE3& T_camera_model);

  // False for a window in which a patch would slide.
  bool setValues(const Window& window);

  // Inverse compositional search of a translation from where the pose says; the pose gives the
  // affine part of the warp, mean and contrast are normalised.
  void align(const Image<uint8_t>& image, const Camera& camera, const SE3& T_camera_model,
             double smallest_correlation);
};

}  // namespace diorama
