// The camera of each row: with a rolling shutter every row is exposed from a pose of its own.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <vector>

#include "sim/bvh.h"
#include "sim/ray_table.h"
#include "sim/renderer.h"

namespace diorama {

// A pose as rays need it.
struct CameraFrame {
  SE3 T_world_camera;
  Vector3d origin;
  Matrix3d R;  // columns are the camera's axes in the world
  explicit CameraFrame(const SE3& T)
      : T_world_camera(T), origin(T.translation), R(T.rotationMatrix()) {}

  // Directions (x, y, 1) in the camera frame.
  RayPacket rays(simd::Float8 x, simd::Float8 y) const {
    return {simd::splat3(origin),
            simd::splat3(R.col(0)) * x + simd::splat3(R.col(1)) * y + simd::splat3(R.col(2))};
  }
};

// The lanes of a packet's second row from `second`, the others from `first`.
inline RayPacket joinRows(const RayPacket& first, const RayPacket& second) {
  return {simd::select(kSecondRow, second.origin, first.origin),
          simd::select(kSecondRow, second.direction, first.direction)};
}

class RowCameras {
 public:
  // Rows from -height to 2 * height: silhouettes go on beyond the image, and so does time.
  RowCameras(const ExposureMotion& motion, int height) : height_(height) {
    if (motion.row_time_s == 0) {
      frames_.emplace_back(motion.T_world_camera(0));
      return;
    }
    for (int y = -height; y < 2 * height; ++y)
      frames_.emplace_back(motion.T_world_camera(motion.rowOffset_s(y, height)));
  }

  bool rolling() const { return frames_.size() > 1; }
  const CameraFrame& operator[](int y) const {
    return frames_[rolling() ? static_cast<size_t>(std::clamp(y + height_, 0, 3 * height_ - 1))
                             : 0];
  }
  // The rays through the pixel centres of a packet whose first row is y.
  RayPacket rays(const PacketRays& packet, int y) const {
    const simd::Float8 dx = simd::load(packet.x), dy = simd::load(packet.y);
    const RayPacket first = (*this)[y].rays(dx, dy);
    return rolling() ? joinRows(first, (*this)[y + 1].rays(dx, dy)) : first;
  }

 private:
  int height_;
  std::vector<CameraFrame> frames_;  // one, or 3 * height
};

}  // namespace diorama
