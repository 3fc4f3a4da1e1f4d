// A moment of the exposure, as the raster renderer draws it.
#pragma once

#include <vector>

#include "core/se3.h"
#include "sim/render_scene.h"
#include "sim/renderer.h"
#include "sim/wide_views.h"

namespace diorama {

struct Subframe {
  std::vector<SE3> T_layer_camera;       // of what rests (the world), and of each moving object
  Vector2d shift_px = Vector2d::Zero();  // of the samples within the view's pixels
  float weight = 1;
};

Subframe subframeAt(const RenderScene& scene, const ExposureMotion& motion, double offset_s);

// Sub-frame k of the `count` that the exposure is divided into. Their shifts cancel in pairs, so
// that no edge moves.
Subframe subframeOf(const RenderScene& scene, const ExposureMotion& motion, int k, int count);

// The layers' poses in a view, T_view_layer.
std::vector<SE3> posesIn(const WideView& view, const Subframe& subframe);

}  // namespace diorama
