// The directions of a camera's rays, in an order that suits packets of eight: tiles of 32 x 32
// pixels, in them packets of 4 x 2 pixels.
#pragma once

#include <vector>

#include "core/camera.h"
#include "sim/simd.h"

namespace diorama {

constexpr int kTileSize = 32;
constexpr int kPacketWidth = 4;
constexpr int kPacketHeight = 2;
constexpr int kPacketsPerRow = kTileSize / kPacketWidth;  // of a tile
constexpr int kPacketsPerTile = kTileSize * kTileSize / 8;

// Pixel of a lane relative to its packet's first.
constexpr int laneX(int lane) { return lane & 3; }
constexpr int laneY(int lane) { return lane >> 2; }
constexpr simd::Int8 kSecondRow = {0, 0, 0, 0, -1, -1, -1, -1};  // mask

struct PacketRays {
  float x[8], y[8];                  // direction (x, y, 1) of each pixel's centre, camera frame
  float dx_du, dx_dv, dy_du, dy_dv;  // change per pixel, the same for the packet
  float pixel;                       // width of a pixel per metre of depth: square root of its area
  int valid;                         // bit per lane: the pixel is in the image and has a ray
  int inside;                        // bit per lane: the pixel is in the image
};

class RayTable {
 public:
  explicit RayTable(const Camera& camera);

  int tilesX() const { return tiles_x_; }
  int tileCount() const { return tiles_x_ * tiles_y_; }
  int paddedWidth() const { return tiles_x_ * kTileSize; }
  int paddedHeight() const { return tiles_y_ * kTileSize; }

  // Packet p of a tile lies at pixel (packetX, packetY).
  int packetX(int tile, int p) const {
    return tile % tiles_x_ * kTileSize + p % kPacketsPerRow * kPacketWidth;
  }
  int packetY(int tile, int p) const {
    return tile / tiles_x_ * kTileSize + p / kPacketsPerRow * kPacketHeight;
  }
  const PacketRays& packet(int tile, int p) const {
    return packets_[static_cast<size_t>(tile * kPacketsPerTile + p)];
  }

 private:
  PacketRays makePacket(const Camera& camera, int x, int y) const;
  int tiles_x_, tiles_y_;
  std::vector<PacketRays> packets_;
};

// The camera's rays beyond the image, for silhouettes that leave it: the camera model where it goes
// on, and from there on radially with the focal length of a pinhole. Directions with z = 1.
Vector2d extendedDirection(const Camera& camera, const Vector2d& u_px);

// These directions over the image and as much to each side: exact at the corners of cells of 8 x 8
// px, between them interpolated, which is good to a small part of a pixel.
class ExtendedGrid {
 public:
  static constexpr int kCell = 8;  // px
  explicit ExtendedGrid(const Camera& camera);

  int columns() const { return columns_; }
  int rows() const { return rows_; }
  // Pixel of a cell's first.
  int cellX(int c) const { return c * kCell - width_; }
  int cellY(int r) const { return r * kCell - height_; }
  const Eigen::Vector2f& corner(int c, int r) const {
    return corners_[static_cast<size_t>(r * (columns_ + 1) + c)];
  }
  struct Directions {
    simd::Float8 x, y;
  };
  // Of the eight pixels of one row of a cell.
  Directions row(int c, int r, int row) const;

 private:
  int width_, height_, columns_, rows_;
  std::vector<Eigen::Vector2f> corners_;
};

}  // namespace diorama
