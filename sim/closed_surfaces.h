// Parts of meshes that have an inside: who is outside sees no back of their triangles before a
// front, so that half of the triangles need not be looked at.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "core/types.h"

namespace diorama {

struct RenderScene;

struct ClosedSurfaces {
  static constexpr int kOpen = -1;
  std::vector<int> of_triangle;            // a place in `boxes`, or kOpen
  std::vector<Eigen::AlignedBox3f> boxes;  // around each, in the frame of the corners
};

// Triangles hang together by corners of one place in one instance. A surface is closed when each of
// its edges is passed as often in one direction as in the other; then every place has a number of
// times that the surface winds around it. The back of a triangle is hidden where that number is not
// 0 behind all of it, which rays find; triangles through which their surface passes count as open,
// and so do those where it is turned inside out. Behind the corners there is a spare one.
ClosedSurfaces findClosedSurfaces(const RenderScene& scene);

}  // namespace diorama
