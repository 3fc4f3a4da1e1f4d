// A mesh small enough to be drawn in a report.
#pragma once

#include "core/mesh.h"

namespace diorama {

// Positions and triangles only, at most max_triangles: vertices of one cell of a grid become one
// (Rossignac and Borrel 1993), the grid as fine as the limit allows.
Mesh previewMesh(const Mesh& mesh, size_t max_triangles = 4000);

}  // namespace diorama
