// The 8 x 8 patch of a point as another frame should see it: warped from the keyframe that saw it.
#pragma once

#include <array>
#include <optional>

#include "core/camera.h"
#include "vo/map.h"

namespace diorama::vo {

struct Patch {
  static constexpr int kSize = 8;
  static constexpr int kBordered = 10;
  std::array<float, kBordered * kBordered> bordered;  // grey levels, one pixel more on each side
  int level = 0;  // of the pyramid of the frame in which it is to be found

  float at(int x, int y) const {
    return bordered[static_cast<size_t>((y + 1) * kBordered + x + 1)];
  }
  // The 64 values without the border, row by row.
  std::array<float, kSize * kSize> inner() const;
};

// The patch as the camera itself sees it.
std::optional<Patch> cutPatch(const ImagePyramid& pyramid, const Vector2d& u_px, int level);

// The patch around u_px, at p_reference in space, warped affinely as the other camera sees it; the
// surface is taken as parallel to the reference's image plane. Nothing when it would be warped too
// much or leaves the reference's image. The level in the other pyramid (of so many levels) keeps
// the resolution. The patch is blurred along smear_px, which is how far the point moves in the
// other image while the shutter is open.
std::optional<Patch> warpPatch(const Camera& camera, const ImagePyramid& reference,
                               const Vector2d& u_px, int level, const Vector3d& p_reference,
                               const SE3& T_other_reference, int levels,
                               const Vector2d& smear_px = Vector2d::Zero());

}  // namespace diorama::vo
