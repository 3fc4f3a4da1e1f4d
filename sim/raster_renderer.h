// The raster renderer: OSMesa finds the triangle that each pixel of a wide pinhole view shows; the
// shading is the ray renderer's.
#pragma once

#include <memory>

#include "core/camera.h"
#include "sim/render_scene.h"
#include "sim/renderer.h"

namespace diorama {

// Colours are shaded at the pixels of the undistorted view, 1, 4 or 9 for each of the camera's, and
// averaged once over the camera's pixels; motion blur is the mean of sharp pictures along the
// exposure. Truth is intersected with each camera pixel's own ray: the triangles seen around it
// are tried inside a surface; at outlines, where something narrower than a pixel of the view may
// stand, and where they are missed, the ray is traced.
class RasterRenderer : public Renderer {
 public:
  // The scene's light must be baked. Throws Error when OSMesa has no context to offer.
  RasterRenderer(std::shared_ptr<const RenderScene> scene, Camera camera, RenderOptions options);
  ~RasterRenderer() override;

  // One caller at a time. Throws Error for a rolling shutter.
  RenderedFrame render(const ExposureMotion& motion) const override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace diorama
