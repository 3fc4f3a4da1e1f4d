// Points of a light grid that lie together, so that most can be passed over a group at a time.
#pragma once

#include <cstdint>
#include <vector>

#include "core/types.h"

namespace diorama {

struct PointGroup {
  uint32_t first = 0, end = 0;  // in the order of groups
  Vector3f center = Vector3f::Zero();
  float radius_m = 0;  // of a sphere around its points
};

struct PointGroups {
  std::vector<uint32_t> order;  // points along a curve that fills space (G. Morton, 1966)
  std::vector<PointGroup> groups;
};

PointGroups groupPoints(const std::vector<Vector3f>& positions);

}  // namespace diorama
