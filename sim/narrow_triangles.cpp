#include "sim/narrow_triangles.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace diorama {
namespace {

using Vector2f = Eigen::Vector2f;

// A strip as wide as a pixel holds a centre in each row or each column.
constexpr float kNarrow_px = 1;
constexpr float kNear_m = 1e-3f;  // as the raster's

// Vertices in the image; infinite where they are not before the view.
std::vector<Vector2f> project(const RenderScene& scene, const SE3& T_view_scene,
                              const PinholeView& view) {
  const Eigen::Matrix3f R = T_view_scene.rotation.toRotationMatrix().cast<float>();
  const Vector3f t = T_view_scene.translation.cast<float>();
  const auto fx = static_cast<float>(view.fx), fy = static_cast<float>(view.fy),
             cx = static_cast<float>(view.cx), cy = static_cast<float>(view.cy);
  std::vector<Vector2f> result;
  result.reserve(scene.corners.size());
  for (const Vector3f& corner : scene.corners) {
    const Vector3f p = R * corner + t;
    result.push_back(p.z() > kNear_m ? Vector2f(fx * p.x() / p.z() + cx, fy * p.y() / p.z() + cy)
                                     : Vector2f::Constant(std::numeric_limits<float>::infinity()));
  }
  return result;
}

// The part of a + s (b - a), 0 <= s <= 1, that lies within a pixel of the view.
struct Clipped {
  float from = 0, to = 1;
  void by(float a, float b, float high) {
    if (a == b) {
      if (a < -1 || a > high) to = -1;
      return;
    }
    const float s = (-1 - a) / (b - a), e = (high - a) / (b - a);
    from = std::max(from, std::min(s, e));
    to = std::min(to, std::max(s, e));
  }
};

void markLine(const Vector2f& a, const Vector2f& b, const PinholeView& view,
              std::vector<uint8_t>& marks) {
  Clipped part;
  part.by(a.x(), b.x(), static_cast<float>(view.width));
  part.by(a.y(), b.y(), static_cast<float>(view.height));
  if (part.from > part.to) return;
  const float length = (part.to - part.from) * (b - a).norm();
  const int steps = static_cast<int>(std::ceil(2 * length));
  for (int k = 0; k <= steps; ++k) {
    const float s = part.from + (part.to - part.from) * static_cast<float>(k) /
                                    static_cast<float>(std::max(1, steps));
    const Vector2f p = a + s * (b - a);
    const auto x = static_cast<int>(std::lround(p.x())), y = static_cast<int>(std::lround(p.y()));
    for (int r = std::max(0, y - 1); r <= std::min(view.height - 1, y + 1); ++r)
      for (int c = std::max(0, x - 1); c <= std::min(view.width - 1, x + 1); ++c)
        marks[static_cast<size_t>(r) * static_cast<size_t>(view.width) + static_cast<size_t>(c)] =
            1;
  }
}

}  // namespace

void markNarrowTriangles(const RenderScene& scene, const SE3& T_view_scene, const PinholeView& view,
                         std::vector<uint8_t>& marks) {
  const std::vector<Vector2f> corners = project(scene, T_view_scene, view);
  for (size_t i = 0; i + 2 < scene.indices.size(); i += 3) {
    std::array<Vector2f, 3> p;
    for (size_t k = 0; k < 3; ++k) p[k] = corners[scene.indices[i + k]];
    const Vector2f low = p[0].cwiseMin(p[1]).cwiseMin(p[2]),
                   high = p[0].cwiseMax(p[1]).cwiseMax(p[2]);
    if (!(high.x() > -1 && high.y() > -1 && low.x() < static_cast<float>(view.width) &&
          low.y() < static_cast<float>(view.height) && high.allFinite()))
      continue;
    // p[0] p[1] becomes the longest side.
    const auto square = [&](size_t a, size_t b) { return (p[a] - p[b]).squaredNorm(); };
    if (square(1, 2) > square(0, 1)) std::swap(p[0], p[2]);
    if (square(0, 2) > square(0, 1)) std::swap(p[1], p[2]);
    const Vector2f side = p[1] - p[0], apex = p[2] - p[0];
    const float length2 = side.squaredNorm();
    const float twice_area = side.x() * apex.y() - side.y() * apex.x();
    if (twice_area * twice_area >= kNarrow_px * kNarrow_px * length2 && length2 > 0) continue;
    // Half way between the side and the apex no point of the triangle is half a pixel away.
    const Vector2f middle =
        length2 > 0 ? Vector2f(0.5f * (apex - side * (side.dot(apex) / length2))) : Vector2f(0, 0);
    markLine(p[0] + middle, p[1] + middle, view, marks);
  }
}

}  // namespace diorama
