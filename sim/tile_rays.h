// Where the rays of the image's tiles go.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "sim/placed_triangle.h"
#include "sim/ray_table.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace diorama {

constexpr int kTileBlocks = 8;  // of 4 x 4 pixels, along each side of a tile
static_assert(kTileBlocks * kPacketWidth == kTileSize && kTileBlocks == kPacketsPerRow);

// Where the rays of a tile go.
struct TileRays {
  struct Row {  // boxes around the rays of eight blocks
    simd::Float8 x, y, half_x, half_y;
  };
  DirectionBox box;  // of the rays up to some pixels beyond the tile
  float dx_du = 0, dx_dv = 0, dy_du = 0, dy_dv = 0;  // greatest changes per pixel
  std::array<Row, kTileBlocks> rows;
  simd::Float8 column_low, column_high, row_low, row_high;

  TileRays(const RayTable& table, int tile, float margin_px) {
    std::array<DirectionBox, kTileBlocks> columns, lines;
    for (int r = 0; r < kTileBlocks; ++r)
      for (int c = 0; c < kTileBlocks; ++c) {
        DirectionBox block;
        for (int p : packetsOf(r, c)) {
          const PacketRays& packet = table.packet(tile, p);
          if (packet.valid != 0) countPitch(packet);
          for (int lane = 0; lane < 8; ++lane)
            if (packet.valid >> lane & 1) block.extend(packet.x[lane], packet.y[lane]);
        }
        setBlock(rows[static_cast<size_t>(r)], c, block);
        columns[static_cast<size_t>(c)].extend(block);
        lines[static_cast<size_t>(r)].extend(block);
        box.extend(block);
      }
    for (size_t k = 0; k < kTileBlocks; ++k) {
      column_low[k] = columns[k].x0;
      column_high[k] = columns[k].x1;
      row_low[k] = lines[k].y0;
      row_high[k] = lines[k].y1;
    }
    const float x = marginX(margin_px, margin_px), y = marginY(margin_px, margin_px);
    box = {box.x0 - x, box.x1 + x, box.y0 - y, box.y1 + y};
  }

  // How far directions go with so many pixels.
  float marginX(float u_px, float v_px) const { return dx_du * u_px + dx_dv * v_px; }
  float marginY(float u_px, float v_px) const { return dy_du * u_px + dy_dv * v_px; }

  static std::array<int, 2> packetsOf(int row, int column) {
    const int upper = 2 * row * kPacketsPerRow + column;
    return {upper, upper + kPacketsPerRow};
  }

 private:
  void countPitch(const PacketRays& packet) {
    dx_du = std::max(dx_du, std::abs(packet.dx_du));
    dx_dv = std::max(dx_dv, std::abs(packet.dx_dv));
    dy_du = std::max(dy_du, std::abs(packet.dy_du));
    dy_dv = std::max(dy_dv, std::abs(packet.dy_dv));
  }
  static void setBlock(Row& row, int c, const DirectionBox& block) {
    const bool empty = block.x0 > block.x1;
    row.x[c] = empty ? 0 : (block.x0 + block.x1) / 2;
    row.y[c] = empty ? 0 : (block.y0 + block.y1) / 2;
    row.half_x[c] = empty ? 0 : (block.x1 - block.x0) / 2 + kBoxRounding;
    row.half_y[c] = empty ? 0 : (block.y1 - block.y0) / 2 + kBoxRounding;
  }
};

// Which of some intervals, one behind the other, another one may touch.
class TileRanks {
 public:
  struct Interval {
    float low, high;
  };
  explicit TileRanks(const std::vector<Interval>& intervals) {
    for (const Interval& i : intervals) {
      low_ = std::min(low_, i.low);
      high_ = std::max(high_, i.high);
    }
    for (size_t slot = 0; slot < kSlots; ++slot) {
      const Interval part{edge(slot) - kBoxRounding, edge(slot + 1) + kBoxRounding};
      while (first_[slot] < intervals.size() && intervals[first_[slot]].high < part.low)
        ++first_[slot];
      end_[slot] = static_cast<uint32_t>(intervals.size());
      while (end_[slot] > 0 && intervals[end_[slot] - 1].low > part.high) --end_[slot];
    }
  }
  // The first and one past the last.
  std::pair<uint32_t, uint32_t> touched(float low, float high) const {
    return {first_[slot(low)], end_[slot(high)]};
  }

 private:
  static constexpr size_t kSlots = 256;
  float edge(size_t slot) const {
    return low_ + (high_ - low_) * static_cast<float>(slot) / kSlots;
  }
  size_t slot(float v) const {
    const float place = (v - low_) * (kSlots / (high_ - low_));
    return static_cast<size_t>(std::clamp(place, 0.f, kSlots - 1.f));
  }

  float low_ = std::numeric_limits<float>::infinity(), high_ = -low_;
  std::array<uint32_t, kSlots> first_{}, end_{};
};

}  // namespace diorama

#pragma GCC diagnostic pop
