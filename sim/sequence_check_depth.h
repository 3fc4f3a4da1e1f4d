// Whether depth images and camera poses agree: a surface that does not move must lie at the same
// place in whichever frame shows it.
//
// A surface is taken from a frame as the plane through 3 x 3 pixels of one instance (inverse depth
// is linear in the image of a plane), where these lie on a plane to within the resolution of the
// file. What is seen from elsewhere is compared along the pixel's own ray: nothing is interpolated
// across an outline, and where a surface is hidden, or too small to have a plane, nothing is said.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "core/se3.h"

namespace diorama {

struct DepthView {
  SE3 T_world_camera;
  std::vector<SE3> row_poses;  // T_world_camera of each row; empty: that of the frame
  Image<float> depth_m;        // 0 = none
  Image<uint16_t> ids;         // of instances, same size

  const SE3& cameraOf(int row) const {
    return row_poses.empty() ? T_world_camera : row_poses[static_cast<size_t>(row)];
  }
};

struct Pixel {
  int x = 0, y = 0;
};

// Samples of one instance that two frames both show, and those that lie apart.
struct Agreement {
  int samples = 0, off = 0;
  double offRatio() const { return samples == 0 ? 0 : static_cast<double>(off) / samples; }
};

class DepthComparison {
 public:
  explicit DepthComparison(const Camera& camera);

  // The pixel's depth minus the depth at which the surface that `other` shows crosses the pixel's
  // ray, m; nothing when `other` shows no surface there that can be compared.
  std::optional<double> difference(const DepthView& view, Pixel pixel,
                                   const DepthView& other) const;

  // Pixels that continue no line of two of their neighbours.
  std::vector<Pixel> lonelyPixels(const DepthView& view) const;

  // How many of the 12 lines of two neighbours a pixel would continue if it were `off_m` nearer.
  int continuedLines(const DepthView& view, Pixel pixel, double off_m) const;

  // Whether a pixel lies farther than one of those around it by about off_m (nearer if negative).
  bool standsOff(const DepthView& view, Pixel pixel, double off_m) const;

  // Over a grid of pixels with a surface around them, by instance id.
  std::vector<Agreement> compare(const DepthView& view, const DepthView& other, int ids) const;

  // The same for one instance.
  Agreement compareInstance(const DepthView& view, const DepthView& other, uint16_t id) const;

  // Where `other` sees the pixel's point; nothing outside the image.
  struct Place {
    Vector2d u_px;
    Vector3d p;  // in the camera frame of `other`, m
  };
  std::optional<Place> placeOf(const DepthView& view, Pixel pixel, const DepthView& other) const;

  // The pixel in which `other` sees this one's point at a depth after it has moved by `motion` in
  // the world.
  std::optional<Vector2d> carry(const DepthView& view, Pixel pixel, double depth_m,
                                const DepthView& other, const SE3& motion) const;

  // The length on a surface that faces the camera which one pixel covers, m.
  double footprint(const DepthView& view, Pixel pixel) const;

  // Of the plane around a pixel, unit, in the camera frame, towards the camera; nothing where there
  // is none, or where it is so near that the depth's resolution tells little of its slope.
  std::optional<Vector3d> normal(const DepthView& view, Pixel pixel) const;
  const Vector3d& ray(int x, int y) const;  // z = 1; zero where there is none

  // Whether the pixel's point may lie on what `other` shows of the same instance where it belongs:
  // on a plane, or, where edges and facets are smaller than pixels, between its nearest and
  // farthest.
  bool mayShow(const DepthView& view, Pixel pixel, const DepthView& other) const;

 private:
  struct Plane {
    Vector3d n;  // n . p = 1 for its points p in the camera frame
    Pixel center;
  };
  std::optional<Plane> planeOf(const DepthView& view, Pixel center, uint16_t id) const;
  std::optional<Plane> planeNear(const DepthView& view, const Vector2d& u_px, uint16_t id) const;
  std::optional<Vector2d> project(const DepthView& view, Pixel pixel, double depth_m,
                                  const DepthView& other, SE3& T_other_view,
                                  const SE3& motion = {}) const;

  const Camera camera_;
  std::vector<Vector3d> rays_;  // z = 1; zero where there is none
};

}  // namespace diorama
