#include "sim/point_groups.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

namespace diorama {
namespace {

constexpr size_t kGroupPoints = 64;

uint32_t spread(uint32_t x) {  // two zeros before each of ten bits
  x = (x | x << 16) & 0x030000ffu;
  x = (x | x << 8) & 0x0300f00fu;
  x = (x | x << 4) & 0x030c30c3u;
  return (x | x << 2) & 0x09249249u;
}

std::vector<uint32_t> alongCurve(const std::vector<Vector3f>& positions) {
  Eigen::AlignedBox3f box;
  for (const Vector3f& p : positions) box.extend(p);
  const float size = positions.empty() ? 1 : std::max(box.sizes().maxCoeff(), 1e-9f);
  std::vector<std::pair<uint32_t, uint32_t>> keys;
  keys.reserve(positions.size());
  for (uint32_t k = 0; k < positions.size(); ++k) {
    const Vector3f cell = (positions[k] - box.min()) * (1023.f / size);
    const auto axis = [&](int i) { return spread(static_cast<uint32_t>(std::max(cell[i], 0.f))); };
    keys.emplace_back(axis(0) | axis(1) << 1 | axis(2) << 2, k);
  }
  std::sort(keys.begin(), keys.end());
  std::vector<uint32_t> order;
  order.reserve(keys.size());
  for (const auto& [key, k] : keys) order.push_back(k);
  return order;
}

}  // namespace

PointGroups groupPoints(const std::vector<Vector3f>& positions) {
  PointGroups result;
  result.order = alongCurve(positions);
  for (size_t first = 0; first < result.order.size(); first += kGroupPoints) {
    PointGroup group;
    group.first = static_cast<uint32_t>(first);
    group.end = static_cast<uint32_t>(std::min(first + kGroupPoints, result.order.size()));
    Eigen::AlignedBox3f box;
    for (uint32_t k = group.first; k < group.end; ++k) box.extend(positions[result.order[k]]);
    group.center = box.center();
    group.radius_m = 0.5f * box.diagonal().norm();
    result.groups.push_back(group);
  }
  return result;
}

}  // namespace diorama
