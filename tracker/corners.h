// Corners of an image region, strongest first.
#pragma once

#include <vector>

#include "core/image.h"
#include "core/types.h"

namespace diorama {

// At most one whole-pixel corner per cell of 8 x 8 pixels, where the smaller eigenvalue of the
// structure tensor over 5 x 5 pixels is largest (Shi and Tomasi 1994), inside the box [low, high]
// and at least border_px (4 or more) from the image's outline.
std::vector<Vector2d> findCorners(const Image<uint8_t>& image, const Vector2d& low_px,
                                  const Vector2d& high_px, int border_px);

}  // namespace diorama
