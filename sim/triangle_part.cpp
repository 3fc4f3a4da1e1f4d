#include "sim/triangle_part.h"

#include <algorithm>

namespace diorama {

void TrianglePart::clear() {
  corners.clear();
  placed.clear();
  planes.clear();
  found.clear();
  entries.clear();
}

void TrianglePart::sortEntries(size_t tiles) {
  begin.assign(tiles + 1, 0);
  for (const Entry& e : found) ++begin[e.tile + 1];
  for (size_t k = 0; k < tiles; ++k) begin[k + 1] += begin[k];
  entries.resize(found.size());
  std::vector<uint32_t> next(begin.begin(), begin.end() - 1);
  for (const Entry& e : found) entries[next[e.tile]++] = e.placed;
}

unsigned TrianglePart::turnedAway(uint32_t first, const Vector3f& from, float reach_m) const {
  const simd::Float8 above =
      simd::load(&normal_x_[first]) * from.x() + simd::load(&normal_y_[first]) * from.y() +
      simd::load(&normal_z_[first]) * from.z() - simd::load(&distance_[first]);
  const float rounding_m = 1e-5f * (1 + from.lpNorm<1>());
  return static_cast<unsigned>(simd::bits(above < -reach_m - rounding_m));
}

void TrianglePart::setPlanes(const RenderScene& scene) {
  const size_t eights = (triangle_count + 7) / 8 * 8;
  for (std::vector<float>* of : {&normal_x_, &normal_y_, &normal_z_}) of->assign(eights, 0.f);
  distance_.assign(eights, -1.f);
  for (uint32_t k = 0; k < triangle_count; ++k) {
    const uint32_t triangle = first_triangle + k;
    const int surface = scene.closed.of_triangle[triangle];
    if (surface == ClosedSurfaces::kOpen) continue;
    const Vector3f n = Eigen::Map<const Vector3f>(scene.triangles[triangle].plane);
    normal_x_[k] = n.x();
    normal_y_[k] = n.y();
    normal_z_[k] = n.z();
    distance_[k] = n.dot(scene.corner(triangle, 0));
    if (closed.empty() || closed.back() != surface) closed.push_back(surface);
  }
}

std::vector<TrianglePart> TrianglePart::of(const RenderScene& scene) {
  constexpr uint32_t kMostTriangles = 1024;
  std::vector<TrianglePart> parts;
  const auto count = static_cast<uint32_t>(scene.triangles.size());
  for (uint32_t end = 0; end < count;) {
    TrianglePart& part = parts.emplace_back();
    part.first_triangle = end;
    const int instance = scene.triangles[end].instance;
    uint32_t low = UINT32_MAX, high = 0;
    for (; end < count && end < part.first_triangle + kMostTriangles &&
           scene.triangles[end].instance == instance;
         ++end)
      for (uint32_t k = 3 * end; k < 3 * end + 3; ++k) {
        low = std::min(low, scene.indices[k]);
        high = std::max(high, scene.indices[k]);
        part.box.extend(scene.corners[scene.indices[k]].cast<double>());
      }
    part.triangle_count = end - part.first_triangle;
    part.first_corner = low;
    part.corner_count = high - low + 1;
    part.setPlanes(scene);
  }
  return parts;
}

}  // namespace diorama
