// Colours of a raster view's pixels, of which the triangles that they show are known.
#pragma once

#include <cstdint>
#include <vector>

#include "sim/render_scene.h"
#include "sim/row_cameras.h"
#include "sim/subframe.h"
#include "sim/wide_views.h"

namespace diorama {

struct ViewPainter {
  const std::vector<const RenderScene*>& layers;  // what rests, and each moving object
  std::vector<LightView> lights;                  // one per layer
  float brightest = 0;                            // ExposureMotion::brightest

  // Adds what the two rows from `row` on show in a sub-frame. `ids` count the triangles of all
  // layers from 1 on; 0 is the sky.
  void addRows(const WideView& view, int row, const Subframe& subframe,
               const std::vector<uint32_t>& ids, std::vector<LinearColor>& colors) const;

 private:
  simd::Vector8 colorOf(simd::Int8 shown, const std::vector<CameraFrame>& frames, simd::Float8 x,
                        simd::Float8 y, simd::Float8 pixel) const;
};

}  // namespace diorama
