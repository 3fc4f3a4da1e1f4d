// Points all over the surface of a mesh.
#pragma once

#include <vector>

#include "core/mesh.h"

namespace diorama {

struct SurfacePoint {
  Vector3d p, normal;  // m, unit, object frame
  size_t triangle;
};

// So many points at equal steps of the area of these triangles, spread within each by the golden
// ratio. None when the area is zero.
std::vector<SurfacePoint> scatterPoints(const Mesh& mesh, const std::vector<size_t>& triangles,
                                        int count);
std::vector<SurfacePoint> scatterPoints(const Mesh& mesh, int count);

}  // namespace diorama
