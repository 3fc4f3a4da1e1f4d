// Triangles that are too narrow for the centres of a view's pixels, and may stand before what the
// pixels show without showing themselves.
#pragma once

#include <cstdint>
#include <vector>

#include "core/se3.h"
#include "sim/render_scene.h"
#include "sim/triangle_raster.h"

namespace diorama {

// Sets those of the view's width x height marks whose pixels, or the ones beside them, a triangle
// narrower than a pixel may touch. Whether it is hidden is not looked at.
void markNarrowTriangles(const RenderScene& scene, const SE3& T_view_scene, const PinholeView& view,
                         std::vector<uint8_t>& marks);

}  // namespace diorama
