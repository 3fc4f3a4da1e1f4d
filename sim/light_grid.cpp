#include "sim/light_grid.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>

namespace diorama {
namespace {

using Box = Eigen::AlignedBox3f;

Box triangleBox(const RenderScene& scene, uint32_t triangle) {
  Box box;
  for (int k = 0; k < 3; ++k) box.extend(scene.corner(triangle, k));
  return box;
}

// Where fine light is worth its price: around the objects, or everywhere when there are none.
Box focusBox(const RenderScene& scene) {
  Box objects, all;
  for (uint32_t k = 0; k < scene.triangles.size(); ++k) {
    all.extend(triangleBox(scene, k));
    if (scene.triangles[k].instance > 0) objects.extend(triangleBox(scene, k));
  }
  return objects.isEmpty() ? all : objects;
}

int sampleCount(int resolution) { return (resolution + 1) * (resolution + 2) / 2; }

struct PointKey {
  std::array<int64_t, 7> q;
  friend bool operator==(const PointKey&, const PointKey&) = default;
};
struct PointKeyHash {
  size_t operator()(const PointKey& key) const {
    uint64_t h = 1469598103934665603ull;
    for (const int64_t x : key.q) {
      h ^= static_cast<uint64_t>(x);
      h *= 0x9E3779B97F4A7C15ull;
      h ^= h >> 29;
    }
    return h;
  }
};

PointKey makeKey(const Vector3f& p, const Vector3f& n, int instance) {
  const auto round = [](float x, double scale) {
    return std::llround(static_cast<double>(x) * scale);
  };
  return {{round(p.x(), 2e4), round(p.y(), 2e4), round(p.z(), 2e4), round(n.x(), 50),
           round(n.y(), 50), round(n.z(), 50), instance}};
}

Vector3f vector(const float* v) { return {v[0], v[1], v[2]}; }

template <class Fn>
void forNeighbours(int i, int j, int resolution, Fn fn) {
  static constexpr int kSteps[6][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {1, -1}, {-1, 1}};
  for (const auto& d : kSteps) {
    const int a = i + d[0], b = j + d[1];
    if (a >= 0 && b >= 0 && a + b <= resolution) fn(a, b);
  }
}

std::vector<int> chooseResolutions(const RenderScene& scene, const LightSpacing& wanted) {
  const Box focus = focusBox(scene);
  std::vector<int> resolutions(scene.triangles.size());
  for (double widen = 1;;) {
    int64_t total = 0;
    for (uint32_t k = 0; k < scene.triangles.size(); ++k) {
      const Vector3f a = scene.corner(k, 0), b = scene.corner(k, 1), c = scene.corner(k, 2);
      const double area2 = static_cast<double>((b - a).cross(c - a).norm());
      const double longest =
          static_cast<double>(std::max({(b - a).norm(), (c - a).norm(), (c - b).norm()}));
      const auto distance = static_cast<double>(focus.exteriorDistance(triangleBox(scene, k)));
      const double spacing = widen * (wanted.spacing_m + wanted.growth * distance);
      // Slivers by their area, not by their longest edge.
      const double size = std::max(std::sqrt(area2), 0.3 * longest);
      resolutions[k] = static_cast<int>(std::clamp(std::ceil(size / spacing), 1.0, 1024.0));
      total += sampleCount(resolutions[k]);
    }
    const auto least = static_cast<int64_t>(3 * scene.triangles.size());
    if (total <= std::max<int64_t>(wanted.max_samples, 2 * least)) return resolutions;
    widen *= 1.02 * std::sqrt(static_cast<double>(total) / wanted.max_samples);
  }
}

}  // namespace

size_t layOutLight(RenderScene& scene, const LightSpacing& spacing) {
  const std::vector<int> resolutions = chooseResolutions(scene, spacing);
  size_t count = 0;
  for (size_t k = 0; k < scene.triangles.size(); ++k) {
    scene.triangles[k].light_offset = static_cast<int>(count);
    scene.triangles[k].light_resolution = resolutions[k];
    count += static_cast<size_t>(sampleCount(resolutions[k]));
  }
  return count;
}

LightGrid makeLightGrid(const RenderScene& scene, int divisor) {
  LightGrid grid;
  for (const ShadingTriangle& t : scene.triangles)
    grid.resolution.push_back((t.light_resolution + divisor - 1) / divisor);
  std::unordered_map<PointKey, uint32_t, PointKeyHash> edge_points;
  for (uint32_t k = 0; k < scene.triangles.size(); ++k) {
    const ShadingTriangle& t = scene.triangles[k];
    const Vector3f p0 = scene.corner(k, 0), e1 = scene.corner(k, 1) - p0,
                   e2 = scene.corner(k, 2) - p0;
    const Vector3f center = p0 + (e1 + e2) / 3;
    const int r = grid.resolution[k];
    grid.offset.push_back(static_cast<int>(grid.point_of_sample.size()));
    for (int j = 0; j <= r; ++j)
      for (int i = 0; i + j <= r; ++i) {
        const float u = static_cast<float>(i) / static_cast<float>(r),
                    v = static_cast<float>(j) / static_cast<float>(r);
        const Vector3f p = p0 + u * e1 + v * e2;
        const Vector3f n =
            (vector(t.normal0) + u * vector(t.normal1) + v * vector(t.normal2)).normalized();
        auto point = static_cast<uint32_t>(grid.positions.size());
        if (i == 0 || j == 0 || i + j == r)
          point = edge_points.emplace(makeKey(p, n, t.instance), point).first->second;
        grid.point_of_sample.push_back(point);
        if (point < grid.positions.size()) continue;
        const Vector3f inwards = center - p;  // 0.2 mm: keeps edges out of faces that abut
        grid.positions.push_back(p + inwards * std::min(0.02f, 2e-4f / (1e-6f + inwards.norm())));
        grid.normals.push_back(n.allFinite() ? n : Vector3f::UnitZ());
      }
  }
  return grid;
}

LightGrid::Cell LightGrid::cellAt(size_t triangle, float u, float v) const {
  const int r = resolution[triangle];
  const float x = u * static_cast<float>(r), y = v * static_cast<float>(r);
  const int i = std::min(static_cast<int>(x), r - 1);
  const int j = std::clamp(static_cast<int>(y), 0, r - 1 - i);
  const float fx = std::clamp(x - static_cast<float>(i), 0.f, 1.f),
              fy = std::clamp(y - static_cast<float>(j), 0.f, 1.f);
  const uint32_t right = point(triangle, i + 1, j), above = point(triangle, i, j + 1);
  if (fx + fy > 1 && i + j + 2 <= r)
    return {{point(triangle, i + 1, j + 1), right, above}, {fx + fy - 1, 1 - fy, 1 - fx}};
  const float s = std::min(fx + fy, 1.f);
  return {{point(triangle, i, j), right, above}, {1 - s, fx, s - fx}};
}

Vector3f LightGrid::at(size_t triangle, float u, float v,
                       const std::vector<Vector3f>& values) const {
  const Cell c = cellAt(triangle, u, v);
  return c.weight[0] * values[c.point[0]] + c.weight[1] * values[c.point[1]] +
         c.weight[2] * values[c.point[2]];
}

std::vector<Vector3f> smoothed(const LightGrid& grid, const std::vector<Vector3f>& values) {
  std::vector<Vector3f> sum(values.size(), Vector3f::Zero());
  std::vector<float> weight(values.size(), 0);
  for (size_t k = 0; k < grid.resolution.size(); ++k) {
    const int r = grid.resolution[k];
    for (int j = 0; j <= r; ++j)
      for (int i = 0; i + j <= r; ++i) {
        const uint32_t p = grid.point(k, i, j);
        forNeighbours(i, j, r, [&](int a, int b) {
          const uint32_t q = grid.point(k, a, b);
          const float alike = std::max(0.f, grid.normals[p].dot(grid.normals[q]));
          const float w = alike * alike * alike * alike;  // what faces elsewhere sees another light
          sum[p] += w * values[q];
          weight[p] += w;
        });
      }
  }
  for (size_t p = 0; p < values.size(); ++p)
    sum[p] = weight[p] > 0 ? Vector3f(0.4f * values[p] + (0.6f / weight[p]) * sum[p]) : values[p];
  return sum;
}

void refill(const LightGrid& grid, std::vector<uint8_t> bad, std::vector<Vector3f>& values) {
  for (int step = 0; step < 3; ++step) {
    std::vector<Vector3f> sum(values.size(), Vector3f::Zero());
    std::vector<float> weight(values.size(), 0);
    for (size_t k = 0; k < grid.resolution.size(); ++k) {
      const int r = grid.resolution[k];
      for (int j = 0; j <= r; ++j)
        for (int i = 0; i + j <= r; ++i) {
          const uint32_t p = grid.point(k, i, j);
          if (!bad[p]) continue;
          forNeighbours(i, j, r, [&](int a, int b) {
            const uint32_t q = grid.point(k, a, b);
            if (bad[q]) return;
            sum[p] += values[q];
            weight[p] += 1;
          });
        }
    }
    for (size_t p = 0; p < values.size(); ++p) {
      if (weight[p] == 0) continue;
      values[p] = sum[p] / weight[p];
      bad[p] = 0;
    }
  }
}

}  // namespace diorama
