#include "sim/tile_motion.h"

#include <algorithm>
#include <cmath>

namespace diorama {

TileMotion motionInTile(int tile, const ExposureMotion& motion, int height, const RayTable& table,
                        const TruthBuffer& truth) {
  if (motion.exposure_s == 0) return {};
  const double middle_s = motion.rowOffset_s(table.packetY(tile, kPacketsPerTile / 2), height);
  const SE3 middle = motion.T_world_camera(middle_s);
  const SE3 T_begin_middle =
      motion.T_world_camera(middle_s - motion.exposure_s / 2).inverse() * middle;
  const SE3 T_end_middle =
      motion.T_world_camera(middle_s + motion.exposure_s / 2).inverse() * middle;
  TileMotion longest;
  for (int k = 0; k < 9; ++k) {
    const int p = (k / 3) * 60 + (k % 3) * 3;  // packets at the corners, sides and middle
    const PacketRays& packet = table.packet(tile, p);
    const int x = table.packetX(tile, p), y = table.packetY(tile, p);
    if (!(packet.valid & 1)) continue;
    const float depth = truth.depth(x, y);
    const double z = depth > 0 ? static_cast<double>(depth) : 1e3;
    const Vector3d point =
        z * Vector3d(static_cast<double>(packet.x[0]), static_cast<double>(packet.y[0]), 1);
    const Vector3d a = T_begin_middle * point, b = T_end_middle * point;
    if (a.z() < 1e-3 || b.z() < 1e-3) return {1e9, 1e9, 1e9};
    const Vector2d way =
        (a.head<2>() / a.z() - b.head<2>() / b.z()) / static_cast<double>(packet.pixel);
    longest.way = std::max(longest.way, way.norm());
    longest.x = std::max(longest.x, std::abs(way.x()));
    longest.y = std::max(longest.y, std::abs(way.y()));
  }
  return longest;
}

}  // namespace diorama
