#include "vo/hidden_regions.h"

#include <algorithm>

#include "vo/map.h"

namespace diorama::vo {
namespace {

constexpr int kCellPx = 80;
constexpr int kFewest = 3;             // points in a cell that tell something
constexpr double kHiddenBelow = 0.25;  // of them are seen

enum class Cell : uint8_t { kUnknown, kSeen, kHidden };

struct Count {
  int seen = 0, failed = 0;
  Cell judge() const {
    if (seen + failed < kFewest) return Cell::kUnknown;
    return seen < kHiddenBelow * (seen + failed) ? Cell::kHidden : Cell::kSeen;
  }
};

}  // namespace

HiddenRegions::HiddenRegions(const Camera& camera, const TrackedFrame& frame,
                             const std::vector<MapPoint*>& failed)
    : columns_((camera.width() + kCellPx - 1) / kCellPx),
      rows_((camera.height() + kCellPx - 1) / kCellPx) {
  std::vector<Count> counts(static_cast<size_t>(columns_ * rows_));
  for (const Feature& feature : frame.features)
    if (feature.point->settled) ++counts[cellOf(feature.u_px)].seen;
  const SE3 T_camera_world = frame.T_world_camera.inverse();
  for (const MapPoint* point : failed) {
    const auto u = camera.project(T_camera_world * point->p_world);
    if (point->settled && u && camera.contains(*u, 0)) ++counts[cellOf(*u)].failed;
  }
  // Where no points are known, it is as it is around.
  hidden_.resize(counts.size());
  seen_.resize(counts.size());
  for (int y = 0; y < rows_; ++y)
    for (int x = 0; x < columns_; ++x) {
      const size_t at = static_cast<size_t>(y * columns_ + x);
      int hidden = 0, seen = 0;
      for (int j = std::max(0, y - 1); j <= std::min(rows_ - 1, y + 1); ++j)
        for (int i = std::max(0, x - 1); i <= std::min(columns_ - 1, x + 1); ++i) {
          const Cell cell = counts[static_cast<size_t>(j * columns_ + i)].judge();
          hidden += cell == Cell::kHidden;
          seen += cell == Cell::kSeen;
        }
      const Cell own = counts[at].judge();
      seen_[at] = own == Cell::kSeen || (own == Cell::kUnknown && hidden == 0 && seen > 0);
      hidden_[at] = own == Cell::kHidden || (own == Cell::kUnknown && hidden > seen);
    }
}

size_t HiddenRegions::cellOf(const Vector2d& u_px) const {
  const int x = std::clamp(static_cast<int>(u_px.x()) / kCellPx, 0, columns_ - 1);
  const int y = std::clamp(static_cast<int>(u_px.y()) / kCellPx, 0, rows_ - 1);
  return static_cast<size_t>(y * columns_ + x);
}

bool HiddenRegions::any() const {
  return std::any_of(hidden_.begin(), hidden_.end(), [](uint8_t cell) { return cell != 0; });
}

bool HiddenRegions::contains(const Vector2d& u_px) const {
  return !hidden_.empty() && hidden_[cellOf(u_px)];
}

bool HiddenRegions::isSeen(const Vector2d& u_px) const {
  return !seen_.empty() && seen_[cellOf(u_px)];
}

}  // namespace diorama::vo
