// A box of directions (x / z, y / z) in the camera frame: where in the image something may be.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "core/se3.h"
#include "sim/ray_table.h"

namespace diorama {

struct DirectionBox {
  float x0 = std::numeric_limits<float>::infinity(), x1 = -x0, y0 = x0, y1 = -x0;

  static DirectionBox everywhere() {
    constexpr float kAll = std::numeric_limits<float>::infinity();
    return {-kAll, kAll, -kAll, kAll};
  }
  // Of what lies between two corners in the object's frame.
  static DirectionBox of(const Vector3d& min, const Vector3d& max, const SE3& T_camera_object) {
    DirectionBox box;
    for (int k = 0; k < 8; ++k) {
      const Vector3d p =
          T_camera_object *
          Vector3d((k & 1 ? max : min).x(), (k & 2 ? max : min).y(), (k & 4 ? max : min).z());
      if (p.z() < 1e-3) return everywhere();  // reaches behind the camera
      box.extend(static_cast<float>(p.x() / p.z()), static_cast<float>(p.y() / p.z()));
    }
    return box;
  }
  void extend(float x, float y) {
    x0 = std::min(x0, x);
    x1 = std::max(x1, x);
    y0 = std::min(y0, y);
    y1 = std::max(y1, y);
  }
  void extend(const DirectionBox& o) {
    x0 = std::min(x0, o.x0);
    x1 = std::max(x1, o.x1);
    y0 = std::min(y0, o.y0);
    y1 = std::max(y1, o.y1);
  }
  bool meets(const DirectionBox& o) const {
    return x0 <= o.x1 && o.x0 <= x1 && y0 <= o.y1 && o.y0 <= y1;
  }
};

// Of the pixel centres of each tile.
inline std::vector<DirectionBox> tileBoxes(const RayTable& table) {
  std::vector<DirectionBox> boxes(static_cast<size_t>(table.tileCount()));
  for (int tile = 0; tile < table.tileCount(); ++tile)
    for (int p = 0; p < kPacketsPerTile; ++p) {
      const PacketRays& packet = table.packet(tile, p);
      for (int lane = 0; lane < 8; ++lane)
        if (packet.valid >> lane & 1)
          boxes[static_cast<size_t>(tile)].extend(packet.x[lane], packet.y[lane]);
    }
  return boxes;
}

}  // namespace diorama
