// The ray renderer: Embree packets, baked light, exact truth at pixel centres.
#pragma once

#include <memory>

#include "core/camera.h"
#include "sim/render_scene.h"
#include "sim/renderer.h"

namespace diorama {

// Colour samples are spread over the pixel and, with blur, over the exposure time; their number
// follows the image's motion and edges. Truth comes from rays of its own through the pixel centres.
class RayRenderer : public Renderer {
 public:
  // The scene's light must be baked.
  RayRenderer(std::shared_ptr<const RenderScene> scene, Camera camera, RenderOptions options);
  ~RayRenderer() override;

  // One caller at a time.
  RenderedFrame render(const ExposureMotion& motion) const override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace diorama
