// Finds a patch in an image to a fraction of a pixel: inverse compositional Lucas-Kanade (Baker and
// Matthews 2004) in position, offset and gain of brightness.
#pragma once

#include <optional>

#include "vo/patch.h"

namespace diorama::vo {

struct AlignedPatch {
  Vector2d u_level;  // where the patch's centre is, in pixels of the level
  double rms = 0;    // of the grey values that remain different
  double gain = 1;
  // Of u_level, px^2: from the patch's gradients and the rms; large along an edge.
  Matrix2d covariance = Matrix2d::Identity();
  Vector2d normal =
      Vector2d::Zero();  // of an edge that was aligned across only, to its bright side
};

// From `start` (pixels of the level). Nothing when it moves farther than max_shift, leaves the
// image or does not settle to 0.03 px (SVO) within ten steps. An edgelet moves along its normal
// only, the direction in which the patch's grey values change most.
std::optional<AlignedPatch> alignFeature(const Image<uint8_t>& image, const Patch& patch,
                                         const Vector2d& start, double max_shift, bool with_gain,
                                         bool edgelet = false);

}  // namespace diorama::vo
