// Corners: the strongest in each free cell of the image, over the finest pyramid levels.
#pragma once

#include <vector>

#include "core/camera.h"
#include "vo/image_pyramid.h"
#include "vo/vo_options.h"

namespace diorama::vo {

// Cells of the image; one feature each.
class CellGrid {
 public:
  CellGrid(int width_px, int height_px, int cell_px)
      : cell_px_(cell_px),
        columns_((width_px + cell_px - 1) / cell_px),
        rows_((height_px + cell_px - 1) / cell_px) {}
  size_t size() const { return static_cast<size_t>(columns_) * static_cast<size_t>(rows_); }
  // The pixel must lie in the image.
  size_t cellOf(const Vector2d& u_px) const {
    const int x = std::min(columns_ - 1, static_cast<int>(u_px.x() + 0.5) / cell_px_);
    const int y = std::min(rows_ - 1, static_cast<int>(u_px.y() + 0.5) / cell_px_);
    return static_cast<size_t>(y) * static_cast<size_t>(columns_) + static_cast<size_t>(x);
  }

 private:
  int cell_px_, columns_, rows_;
};

struct Corner {
  Vector2d u_px;
  int level = 0;
  float score = 0;  // smallest eigenvalue of the mean structure tensor (Shi and Tomasi 1994)
};

// What corners and edgelets have in common.
constexpr int kCornerLevels = 3;  // coarser ones are located too badly
constexpr int kCornerMargin = 7;  // px of the level: a patch with its border fits
// The least score at a level: what the options ask for above what noise explains.
float leastScore(double least, double noise, int level, const VoOptions& options);
// Those with a score, the strongest first, at most `count`.
std::vector<Corner> strongest(std::vector<Corner> corners, int count);

// The strongest first, at most `count`. occupied[cell] = 1 leaves a cell out. The threshold adapts
// to the noise of the image (see VoOptions::min_corner_score).
std::vector<Corner> detectCorners(const ImagePyramid& pyramid, double noise, const CellGrid& grid,
                                  const std::vector<uint8_t>& occupied, int count,
                                  const VoOptions& options, int blurred_levels = 0);

}  // namespace diorama::vo
