// Sparse image alignment: the motion between two frames from the grey values around features of
// known depth, before any feature is searched for (SVO's first step, with robust weights and affine
// brightness).
#pragma once

#include <optional>

#include "core/camera.h"
#include "vo/map.h"
#include "vo/vo_options.h"

namespace diorama::vo {

struct SparseAlignment {
  SE3 T_current_reference;
  int patches = 0;  // seen by both, at the finest level
  double rms = 0;   // grey levels that remain different, at the finest level
};

// Patches of 4 x 4 pixels around the reference's features, coarse to fine, inverse compositional
// Gauss-Newton; a step that makes it worse is taken back. Nothing when too few patches are seen.
std::optional<SparseAlignment> alignSparsely(const Camera& camera, const TrackedFrame& reference,
                                             const ImagePyramid& current,
                                             const SE3& T_current_reference,
                                             const VoOptions& options);

}  // namespace diorama::vo
