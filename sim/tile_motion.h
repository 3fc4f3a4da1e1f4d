// How far what rests goes in a tile of the image while the camera moves.
#pragma once

#include "sim/ray_table.h"
#include "sim/renderer.h"
#include "sim/truth_buffer.h"

namespace diorama {

// During the exposure, px.
struct TileMotion {
  double way = 0, x = 0, y = 0;
};

// The longest ways of nine points of the tile, whose depth is known; 1e9 where one passes the
// camera. `height` is the image's.
TileMotion motionInTile(int tile, const ExposureMotion& motion, int height, const RayTable& table,
                        const TruthBuffer& truth);

}  // namespace diorama
