// Edgelets: pieces of edges, where corners are few. Each is known across its edge only; the light
// of a lamp on a wall, the rim of a desk or a line on a floor hold the camera, too.
#pragma once

#include "vo/corners.h"

namespace diorama::vo {

// The steepest in each free cell, the steepest first, at most `count`; a cell gets none whose
// steepest gradient is no edge above the noise (VoOptions::min_edge_score).
std::vector<Corner> detectEdgelets(const ImagePyramid& pyramid, double noise, const CellGrid& grid,
                                   const std::vector<uint8_t>& occupied, int count,
                                   const VoOptions& options, int blurred_levels = 0);

}  // namespace diorama::vo
