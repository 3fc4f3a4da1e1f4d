// Distance to the nearest image edge of about the same direction (fast directional chamfer
// matching: Liu, Tuzel, Veeraraghavan and Chellappa, CVPR 2010).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/image.h"
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

  // Maps are about 320 cells wide.
  ChamferMaps(const Image<uint8_t>& image, const ChamferOptions& options);

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

  const Image<uint8_t>& coarse(int direction) const {
    return coarse_[static_cast<size_t>(direction)];
  }

 private:
  double at(const Image<float>& map, double x, double y) const;
  Image<uint8_t> ratios(const Image<float>& map) const;

  int cell_ = 1;
  double farthest_px_;
  std::array<Image<float>, kDirections> fine_;
  Image<float> mean_;
  std::array<Image<uint8_t>, kDirections> coarse_;
};

}  // namespace diorama
