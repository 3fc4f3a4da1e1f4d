#include "sim/light_blockers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>
#include <vector>

namespace diorama {

using simd::Float8;
using simd::Int8;
using simd::splat;

namespace {

Eigen::AlignedBox3f boxOf(const RenderScene& object, std::span<const uint32_t> triangles) {
  Eigen::AlignedBox3f box;
  for (const uint32_t k : triangles)
    for (int c = 0; c < 3; ++c) box.extend(object.corner(k, c));
  return box;
}

// Halves the triangles across the longest side of the box around their middles, `depth` times.
void split(const RenderScene& object, std::span<uint32_t> triangles, int depth,
           std::vector<Eigen::AlignedBox3f>& boxes) {
  if (depth == 0) return boxes.push_back(boxOf(object, triangles));
  const auto middle = [&](uint32_t k) -> Vector3f {
    return object.corner(k, 0) + object.corner(k, 1) + object.corner(k, 2);
  };
  Eigen::AlignedBox3f middles;
  for (const uint32_t k : triangles) middles.extend(middle(k));
  Eigen::Index axis = 0;
  if (!triangles.empty()) middles.sizes().maxCoeff(&axis);
  const auto half = triangles.begin() + static_cast<std::ptrdiff_t>(triangles.size() / 2);
  if (half != triangles.end())
    std::nth_element(triangles.begin(), half, triangles.end(),
                     [&](uint32_t a, uint32_t b) { return middle(a)[axis] < middle(b)[axis]; });
  split(object, {triangles.begin(), half}, depth - 1, boxes);
  split(object, {half, triangles.end()}, depth - 1, boxes);
}

}  // namespace

LightBlockers::LightBlockers(const RenderScene& object) {
  std::vector<uint32_t> triangles(object.triangles.size());
  std::iota(triangles.begin(), triangles.end(), 0u);
  std::vector<Eigen::AlignedBox3f> boxes;
  split(object, triangles, kDepth, boxes);
  const Eigen::AlignedBox3f whole = boxOf(object, triangles);
  for (size_t k = 0; k < boxes.size(); ++k)
    for (size_t axis = 0; axis < 3; ++axis) {
      const auto i = static_cast<Eigen::Index>(axis);
      Boxes& some = parts_[k / 8];
      some.min[axis][static_cast<int>(k % 8)] = boxes[k].min()[i];
      some.max[axis][static_cast<int>(k % 8)] = boxes[k].max()[i];
      whole_.min[axis] = splat(whole.min()[i]);
      whole_.max[axis] = splat(whole.max()[i]);
    }
}

// At the share s of the way the rays from the sphere to the light keep within s times the light's
// half diagonal and 1 - s times the sphere's radius.
bool LightBlockers::Boxes::meetCone(const Vector3f& p, float radius_m, const Vector3f& way,
                                    float half) const {
  Float8 from = splat(0.f), to = splat(1.f);
  Int8 meets = splat(-1);
  const auto keep = [&](Float8 a, float b) {  // where a + b s >= 0
    if (b > 0) from = simd::max(from, a * (-1 / b));
    if (b < 0) to = simd::min(to, a * (-1 / b));
    if (b == 0) meets &= a >= 0.f;
  };
  for (size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    keep(p[i] + radius_m - min[axis], half + way[i] - radius_m);
    keep(max[axis] - p[i] + radius_m, half - way[i] - radius_m);
  }
  return simd::bits(meets & (from <= to)) != 0;
}

bool LightBlockers::mayHide(const RectangleLight& light, const Vector3f& center,
                            float radius_m) const {
  const Vector3f way = light.center - center;
  const float half = std::hypot(light.half_u, light.half_v);
  if (!whole_.meetCone(center, radius_m, way, half)) return false;
  return std::any_of(parts_.begin(), parts_.end(),
                     [&](const Boxes& some) { return some.meetCone(center, radius_m, way, half); });
}

}  // namespace diorama
