// Distance to the nearest image edge of about the same direction (fast directional chamfer
// matching: Liu, Tuzel, Veeraraghavan and Chellappa, CVPR 2010).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/frame.h"
#include "core/types.h"
#include "tracker/detector_options.h"

namespace diorama {

class ChamferMaps {
 public:
  static constexpr int kDirections = 12;  // of lines, over 180 degrees
  // Coarse maps hold the distance over what lines of any direction have there, as a byte: this
  // many are a ratio of 1, which is chance.
  static constexpr int kChance = 100;
  static constexpr int kCoarse = 3;  // cells of a fine map along the side of a coarse one

  // Maps are about 320 cells wide. Edges are those of colours where the camera has them: orange on
  // wood may be of one brightness.
  ChamferMaps(const Frame& frame, const ChamferOptions& options);

  // Of a line with this normal; signs do not matter.
  static int directionOf(const Vector2d& normal);

  // Pixels along the side of a cell of the fine maps.
  int cell() const { return cell_; }
  double farthestPx() const { return farthest_px_; }

  // px, of a line at a pixel; farthestPx() outside the image.
  struct Sample {
    double distance_px = 0;
    Vector2d gradient = Vector2d::Zero();  // of the distance
  };
  Sample sample(const Vector2d& u_px, int direction) const;

  // Over all directions.
  double meanDistance(const Vector2d& u_px) const;

  // A coarse map, with a border of chance of kBorder cells all around and kBlock more to the right.
  static constexpr int kBorder = 64, kBlock = 32;
  int coarseWidth() const { return coarse_width_; }
  int coarseHeight() const { return coarse_height_; }
  std::ptrdiff_t coarseStride() const { return coarse_[0].width; }
  // The cell (x, y), which may lie in the border.
  const uint8_t* coarse(int direction, int x, int y) const {
    return coarse_[static_cast<size_t>(direction)].row(y + kBorder) + x + kBorder;
  }

 private:
  double at(const Image<float>& map, double x, double y) const;
  Image<uint8_t> ratios(const Image<float>& map) const;

  int cell_ = 1;
  double farthest_px_;
  std::array<Image<float>, kDirections> fine_;
  Image<float> mean_;
  int coarse_width_ = 0, coarse_height_ = 0;  // without borders
  std::array<Image<uint8_t>, kDirections> coarse_;
};

}  // namespace diorama
