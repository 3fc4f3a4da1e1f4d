// Parts of an image in which something stands before the map: known points should be seen there and
// are not, while elsewhere they are.
#pragma once

#include <cstdint>
#include <vector>

#include "core/camera.h"
#include "core/types.h"

namespace diorama::vo {

struct MapPoint;
struct TrackedFrame;

class HiddenRegions {
 public:
  HiddenRegions() = default;  // nothing is hidden
  // From the frame's features, which agree with its pose, and the points that were searched for and
  // not found, or did not agree.
  HiddenRegions(const Camera& camera, const TrackedFrame& frame,
                const std::vector<MapPoint*>& failed);

  bool any() const;
  bool contains(const Vector2d& u_px) const;
  // Known points are seen here, or around, where none are known here and none are hidden around.
  bool isSeen(const Vector2d& u_px) const;

 private:
  size_t cellOf(const Vector2d& u_px) const;

  int columns_ = 0, rows_ = 0;
  std::vector<uint8_t> hidden_, seen_;
};

}  // namespace diorama::vo
