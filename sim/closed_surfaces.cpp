#include "sim/closed_surfaces.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <numeric>
#include <tuple>

#include "sim/corner_sets.h"
#include "sim/render_scene.h"

namespace diorama {

using simd::Float8;
using simd::Int8;
using simd::splat;

namespace {

// One number for all corners of an instance that lie at one place.
std::vector<uint32_t> placesOf(const RenderScene& scene) {
  std::vector<int> instance(scene.corners.size(), -1);
  for (size_t k = 0; k < scene.indices.size(); ++k)
    instance[scene.indices[k]] = scene.triangles[k / 3].instance;
  const auto key = [&](uint32_t c) {
    const Vector3f& p = scene.corners[c];
    return std::tuple(instance[c], p.x(), p.y(), p.z());
  };
  std::vector<uint32_t> order(scene.corners.size()), places(scene.corners.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) { return key(a) < key(b); });
  for (size_t k = 0; k < order.size(); ++k)
    places[order[k]] =
        k > 0 && key(order[k]) == key(order[k - 1]) ? places[order[k - 1]] : order[k];
  return places;
}

// The places on edges that are passed more often in one direction than in the other.
std::vector<uint32_t> placesOnBorders(const std::vector<uint32_t>& corners) {
  struct Edge {
    uint32_t low, high;
    int way;
  };
  std::vector<Edge> edges;
  for (size_t k = 0; k < corners.size(); ++k) {
    const uint32_t a = corners[k], b = corners[k % 3 == 2 ? k - 2 : k + 1];
    if (a != b) edges.push_back({std::min(a, b), std::max(a, b), a < b ? 1 : -1});
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return std::tie(a.low, a.high) < std::tie(b.low, b.high);
  });
  std::vector<uint32_t> borders;
  for (size_t k = 0; k < edges.size();) {
    const Edge& first = edges[k];
    int sum = 0;
    for (; k < edges.size() && edges[k].low == first.low && edges[k].high == first.high; ++k)
      sum += edges[k].way;
    if (sum != 0) borders.push_back(first.low);
  }
  return borders;
}

ClosedSurfaces withoutBorders(const RenderScene& scene) {
  const std::vector<uint32_t> places = placesOf(scene);
  std::vector<uint32_t> corners;
  for (const uint32_t c : scene.indices) corners.push_back(places[c]);
  CornerSets sets(scene.corners.size());
  for (size_t k = 0; k < corners.size(); k += 3)
    for (size_t other : {k + 1, k + 2}) sets.join(corners[k], corners[other]);
  std::map<uint32_t, int> numbers;  // of sets
  for (const uint32_t place : placesOnBorders(corners))
    numbers[sets.find(place)] = ClosedSurfaces::kOpen;
  ClosedSurfaces result;
  for (size_t k = 0; k < scene.triangles.size(); ++k) {
    const auto next = static_cast<int>(result.boxes.size());
    const auto [found, added] = numbers.try_emplace(sets.find(corners[3 * k]), next);
    if (added) result.boxes.emplace_back();
    result.of_triangle.push_back(found->second);
    if (found->second == ClosedSurfaces::kOpen) continue;
    for (int i = 0; i < 3; ++i)
      result.boxes[static_cast<size_t>(found->second)].extend(
          scene.corner(static_cast<uint32_t>(k), i));
  }
  return result;
}

// One surface alone: how often it winds around places right behind its triangles.
class Winding {
 public:
  Winding(const RenderScene& scene, const std::vector<uint32_t>& triangles)
      : scene_(scene),
        triangles_(triangles),
        indices_(indicesOf(scene, triangles)),
        bvh_({scene.corners.data(), scene.corners.size() - 1}, indices_) {}

  // Of each triangle whether it does behind all of it; not where it cannot be told.
  std::vector<uint8_t> behind() const {
    std::vector<uint8_t> result = uncrossed();
    for (int first = 0; first < static_cast<int>(triangles_.size()); first += 8) {
      const Int8 eight = eightFrom(first);
      for (const Vector3f& weights : {Vector3f(0.33f, 0.34f, 0.33f), Vector3f(0.7f, 0.16f, 0.14f),
                                      Vector3f(0.14f, 0.7f, 0.16f), Vector3f(0.16f, 0.14f, 0.7f)}) {
        const Int8 inside = isBehind(eight, weights);
        for (int lane = 0; lane < 8; ++lane)
          if (inside[lane] == 0) result[static_cast<size_t>(eight[lane])] = 0;
      }
    }
    return result;
  }

 private:
  static constexpr float kStep_m = 2e-6f, kStep = 2e-6f;  // from one hit to the next
  static constexpr int kMostSteps = 200;

  static std::vector<uint32_t> indicesOf(const RenderScene& scene,
                                         const std::vector<uint32_t>& triangles) {
    std::vector<uint32_t> indices;
    for (const uint32_t t : triangles)
      for (uint32_t i = 0; i < 3; ++i) indices.push_back(scene.indices[3 * t + i]);
    return indices;
  }

  Int8 eightFrom(int first) const {
    return simd::min(Int8{0, 1, 2, 3, 4, 5, 6, 7} + first,
                     splat(static_cast<int>(triangles_.size()) - 1));
  }

  // Not of triangles through which the surface passes: it may wind otherwise around their parts.
  std::vector<uint8_t> uncrossed() const {
    std::vector<uint8_t> result(triangles_.size(), 1);
    for (int first = 0; first < static_cast<int>(triangles_.size()); first += 8)
      for (int edge = 0; edge < 3; ++edge) followEdges(eightFrom(first), edge, result);
    return result;
  }

  void followEdges(Int8 triangles, int edge, std::vector<uint8_t>& uncrossed) const {
    RayPacket rays;
    for (int lane = 0; lane < 8; ++lane) {
      const uint32_t t = triangles_[static_cast<size_t>(triangles[lane])];
      put(rays.origin, lane, scene_.corner(t, edge));
      put(rays.direction, lane, scene_.corner(t, (edge + 1) % 3) - scene_.corner(t, edge));
    }
    constexpr float kEnd = 1e-4f;  // of an edge; others begin there
    Int8 active = splat(-1);
    Float8 from = splat(kEnd);
    for (int step = 0; step < kMostSteps && simd::bits(active) != 0; ++step) {
      const PacketHits hits = bvh_.closest(rays, active, from, false);
      active = hits.mask & (hits.t < 1 - kEnd);
      for (int lane = 0; lane < 8; ++lane)
        if (active[lane] != 0 && !holdsEdge(hits.triangle[lane], triangles[lane], edge))
          uncrossed[static_cast<size_t>(hits.triangle[lane])] =
              uncrossed[static_cast<size_t>(triangles[lane])] = 0;
      from = hits.t * (1 + kStep) + 1e-5f;
    }
    for (int lane = 0; lane < 8; ++lane)
      if (active[lane] != 0) uncrossed[static_cast<size_t>(triangles[lane])] = 0;
  }

  // Whether a triangle has an edge of another one.
  bool holdsEdge(int triangle, int other, int edge) const {
    const auto has = [&](const Vector3f& p) {
      const uint32_t t = triangles_[static_cast<size_t>(triangle)];
      return scene_.corner(t, 0) == p || scene_.corner(t, 1) == p || scene_.corner(t, 2) == p;
    };
    const uint32_t o = triangles_[static_cast<size_t>(other)];
    return has(scene_.corner(o, edge)) && has(scene_.corner(o, (edge + 1) % 3));
  }

  static void put(simd::Vector8& to, int lane, const Vector3f& p) {
    to.x[lane] = p.x(), to.y[lane] = p.y(), to.z[lane] = p.z();
  }

  // Mask. `weights` are those of the place in the triangles. A ray along an edge may be counted
  // wrongly: where one says no, two others are asked.
  Int8 isBehind(Int8 triangles, const Vector3f& weights) const {
    const Int8 inside = count(triangles, weights, {0.031f, 0.047f, 0.059f}) > splat(0);
    if (simd::bits(inside) == 0xff) return inside;
    return inside | ((count(triangles, weights, {-0.17f, 0.11f, 0.13f}) > splat(0)) &
                     (count(triangles, weights, {0.09f, -0.21f, 0.15f}) > splat(0)));
  }

  // How much more often rays leave the surface than they enter it; 0 where it cannot be told. Rays
  // do not run along the normals: many meshes have edges there.
  Int8 count(Int8 triangles, const Vector3f& weights, const Vector3f& aside) const {
    RayPacket rays;
    Int8 flat = splat(0);
    for (int lane = 0; lane < 8; ++lane) {
      const uint32_t t = triangles_[static_cast<size_t>(triangles[lane])];
      const Vector3f normal = scene_.normal(t);
      if (!(normal.squaredNorm() > 0)) flat[lane] = -1;
      put(rays.origin, lane,
          weights[0] * scene_.corner(t, 0) + weights[1] * scene_.corner(t, 1) +
              weights[2] * scene_.corner(t, 2));
      put(rays.direction, lane, aside - normal.normalized());
    }
    return simd::select(flat, splat(1), count(triangles, rays, ~flat));
  }

  Int8 count(Int8 triangles, const RayPacket& rays, Int8 active) const {
    Int8 count = splat(0), last = triangles;
    Float8 from = splat(kStep_m);
    for (int step = 0; step < kMostSteps && simd::bits(active) != 0; ++step) {
      const PacketHits hits = bvh_.closest(rays, active, from, false);
      active = hits.mask;
      const Int8 way = simd::select(dot(hits.normal, rays.direction) > 0.f, splat(1), splat(-1));
      count += active & (hits.triangle != last) & way;
      from = hits.t * (1 + kStep) + kStep_m;
      last = hits.triangle;
    }
    return ~active & count;
  }

  const RenderScene& scene_;
  const std::vector<uint32_t>& triangles_;
  std::vector<uint32_t> indices_;
  Bvh bvh_;
};

}  // namespace

ClosedSurfaces findClosedSurfaces(const RenderScene& scene) {
  ClosedSurfaces surfaces = withoutBorders(scene);
  std::vector<std::vector<uint32_t>> triangles(surfaces.boxes.size());
  for (uint32_t k = 0; k < scene.triangles.size(); ++k)
    if (const int surface = surfaces.of_triangle[k]; surface != ClosedSurfaces::kOpen)
      triangles[static_cast<size_t>(surface)].push_back(k);
  for (const std::vector<uint32_t>& surface : triangles) {
    const std::vector<uint8_t> behind = Winding(scene, surface).behind();
    for (size_t k = 0; k < surface.size(); ++k)
      if (behind[k] == 0) surfaces.of_triangle[surface[k]] = ClosedSurfaces::kOpen;
  }
  return surfaces;
}

}  // namespace diorama
