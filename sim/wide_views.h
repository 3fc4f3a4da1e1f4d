// The undistorted pinhole views that together show all that a camera sees, and where the camera's
// pixels lie in them. One view for an ordinary lens; sides of a cube for a fisheye.
#pragma once

#include <vector>

#include "core/camera.h"
#include "core/image.h"
#include "sim/ray_table.h"
#include "sim/renderer.h"
#include "sim/triangle_raster.h"

namespace diorama {

struct WideView {
  PinholeView pinhole;  // width a multiple of 4, height of 2
  Matrix3d R_view_camera;
  std::vector<uint8_t> needed;  // per 4 x 2 pixels: some pixel of the camera takes colour from it
};

// A camera pixel's centre and extent in a view. The extents are those of the axis-aligned rectangle
// with the second moments of the pixel's image, at least one pixel.
struct PlacedPixel {
  float x = 0, y = 0, width = 1, height = 1;  // px of the view
  int view = -1;                              // -1: the camera has no ray here
};

struct alignas(16) LinearColor {
  float r = 0, g = 0, b = 0, unused = 0;
};

class WideViews {
 public:
  // `scale`: pixels of a view per pixel of the camera along each axis, at the optical axis.
  WideViews(const Camera& camera, const RayTable& table, int scale);

  // Around a placed pixel's centre a view goes on for at least this many pixels.
  static constexpr int kMargin = 2;

  const std::vector<WideView>& views() const { return views_; }
  const PlacedPixel& placed(int x, int y) const { return placed_(x, y); }

  // The mean over the camera pixel's extent of a view's colours, each taken for all of its pixel.
  Radiance mean(int x, int y, const std::vector<std::vector<LinearColor>>& colors) const;

 private:
  std::vector<WideView> views_;
  Image<PlacedPixel> placed_;
};

}  // namespace diorama
