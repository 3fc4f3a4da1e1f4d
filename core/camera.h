// Camera models: pinhole, radial-tangential (OpenCV's 4, 5 or 8 coefficients) and fisheye
// (Kannala-Brandt with 4 coefficients, as cv::fisheye). Camera frame: x right, y down, z forward.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/types.h"

namespace diorama {

enum class CameraModel { kPinhole, kRadTan, kFisheye };

std::string toString(CameraModel model);  // pinhole, radtan, fisheye
std::optional<CameraModel> cameraModelFromString(const std::string& name);

struct CameraParameters {
  CameraModel model = CameraModel::kPinhole;
  int width = 640;                                    // px
  int height = 480;                                   // px
  double fx = 525, fy = 525, cx = 319.5, cy = 239.5;  // px; (0, 0) is the centre of the first pixel
  // radtan: 0, 4 (k1 k2 p1 p2), 5 (+k3) or 8 (+k4 k5 k6); fisheye: 0 or 4; pinhole: 0.
  std::vector<double> distortion;

  // What is wrong with these parameters, or nothing.
  std::optional<std::string> problem() const;
};

struct ProjectionWithJacobian {
  Vector2d u_px;
  Matrix23d J;  // d u_px / d p_camera, px/m
};

class Camera {
 public:
  Camera() : Camera(CameraParameters{}) {}
  // The parameters must have no problem(); a programming error otherwise.
  explicit Camera(CameraParameters parameters);

  const CameraParameters& parameters() const { return parameters_; }
  int width() const { return parameters_.width; }
  int height() const { return parameters_.height; }
  double fx() const { return parameters_.fx; }
  double fy() const { return parameters_.fy; }

  // Pixel of a point (m) in the camera frame. Nothing when the point is not in front of the camera
  // or lies beyond the radius up to which the distortion is one-to-one. The pixel may be outside
  // the image.
  std::optional<Vector2d> project(const Vector3d& p_camera) const;
  std::optional<ProjectionWithJacobian> projectWithJacobian(const Vector3d& p_camera) const;

  // Direction with z = 1 of the ray through a pixel; nothing where no ray within 90 degrees maps to
  // it.
  std::optional<Vector3d> unproject(const Vector2d& u_px) const;

  // Whether a pixel lies in the image, at least margin_px from its outline.
  bool contains(const Vector2d& u_px, double margin_px = 0) const {
    return u_px.x() >= margin_px - 0.5 && u_px.y() >= margin_px - 0.5 &&
           u_px.x() <= width() - 0.5 - margin_px && u_px.y() <= height() - 0.5 - margin_px;
  }

 private:
  struct Distorted {
    Vector2d xy;
    Matrix2d J;  // d xy / d (x, y)
  };
  Distorted distort(const Vector2d& xy) const;  // normalised coordinates, J included
  Distorted distortRadTan(const Vector2d& xy) const;
  Distorted distortFisheye(const Vector2d& xy) const;
  double findMaxRadius() const;

  CameraParameters parameters_;
  std::array<double, 8> k_{};  // distortion, missing coefficients are zero
  bool distorted_ = false;
  double max_radius_ = 0;  // of normalised undistorted coordinates
};

}  // namespace diorama
