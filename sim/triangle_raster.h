// Which triangle stands foremost in each pixel of a pinhole view: drawn by OSMesa, an
// OpenGL 4.5 core context that needs neither a screen nor a graphics card.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/se3.h"
#include "sim/render_scene.h"

namespace diorama {

// A point (x, y, z) of the view's frame, z forward, lies at pixel (f x / z + cx, f y / z + cy).
struct PinholeView {
  int width = 0, height = 0;
  double fx = 1, fy = 1, cx = 0, cy = 0;  // px; pixel (0, 0) is a pixel's centre
};

class TriangleRaster {
 public:
  // Scenes that are drawn together, each in a frame of its own; they must outlive it. Throws Error
  // when there is no such context.
  TriangleRaster(std::span<const RenderScene* const> layers, int most_width, int most_height);
  ~TriangleRaster();

  // `ids` receives width x height numbers, rows downwards: 0 for nothing, else the triangle's + 1,
  // counted through all layers. What is nearer than 1 mm is cut off. One caller at a time, from any
  // thread: another raster may draw meanwhile.
  void draw(const PinholeView& view, std::span<const SE3> T_view_layer, std::vector<uint32_t>& ids);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace diorama
