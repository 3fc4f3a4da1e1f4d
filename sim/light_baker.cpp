#include "sim/light_baker.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "sim/light_grid.h"
#include "sim/shading.h"

namespace diorama {
namespace {

using simd::Float8;
using simd::Int8;
using simd::splat;
using simd::Vector8;

uint32_t hash(uint32_t x) {  // a mixer by C. Wellons (hash prospector)
  x ^= x >> 16;
  x *= 0x7feb352du;
  x ^= x >> 15;
  x *= 0x846ca68bu;
  return x ^ (x >> 16);
}
float fraction(uint32_t bits) { return static_cast<float>(bits >> 8) * (1.f / 16777216.f); }
float wrap(float x) { return x - std::floor(x); }

// Two unit vectors square to n and to each other (T. Duff et al. 2017).
std::array<Vector3f, 2> basis(const Vector3f& n) {
  const float s = std::copysign(1.f, n.z()), a = -1.f / (s + n.z()), b = n.x() * n.y() * a;
  return {Vector3f(1 + s * n.x() * n.x() * a, s * b, -s * n.x()),
          Vector3f(b, s + n.y() * n.y() * a, -n.y())};
}

class Baker {
 public:
  Baker(RenderScene& scene, const LightBakerOptions& options, WorkerPool& pool)
      : scene_(scene), options_(options), pool_(pool) {}

  void run() {
    std::vector<int> fine = chooseResolutions(scene_, options_.spacing_m, options_.spacing_growth,
                                              options_.max_samples);
    std::vector<int> coarse = fine;
    for (int& r : coarse) r = (r + 2) / 3;  // bounced light has no sharp edges
    direct_grid_ = makeLightGrid(scene_, std::move(fine));
    bounce_grid_ = makeLightGrid(scene_, std::move(coarse));
    for (size_t k = 0; k < scene_.triangles.size(); ++k) {
      scene_.triangles[k].light_offset = direct_grid_.offset[k];
      scene_.triangles[k].light_resolution = direct_grid_.resolution[k];
    }
    direct_.assign(direct_grid_.pointCount(), Vector3f::Zero());
    bounced_.assign(bounce_grid_.pointCount(), Vector3f::Zero());
    forPoints(direct_.size(), [&](size_t p) { direct_[p] = directLight(p); });
    publish();
    for (int bounce = 0; bounce < options_.bounces; ++bounce) gather(bounce);
  }

 private:
  static constexpr size_t kChunk = 512;

  template <class Fn>
  void forPoints(size_t count, Fn fn) {
    const size_t chunks = (count + kChunk - 1) / kChunk;
    pool_.run(static_cast<int>(chunks), [&](int chunk) {
      const size_t first = static_cast<size_t>(chunk) * kChunk;
      for (size_t p = first; p < std::min(count, first + kChunk); ++p) fn(p);
    });
  }

  // Sum over the lights of visible cos cos / r^2 dA / pi.
  Vector3f directLight(size_t p) const {
    const Vector3f& n = direct_grid_.normals[p];
    const Vector3f origin = direct_grid_.positions[p] + options_.surface_offset_m * n;
    Vector3f sum = Vector3f::Zero();
    for (size_t l = 0; l < scene_.lights.size(); ++l) {
      const uint32_t seed =
          hash(static_cast<uint32_t>(p) * 977u + static_cast<uint32_t>(l) * 7919u);
      sum += scene_.lights[l].radiance * formFactor(scene_.lights[l], origin, n, seed);
    }
    return sum;
  }

  // Two packets of stratified rays first; more when they see the light in part.
  float formFactor(const RectangleLight& light, const Vector3f& origin, const Vector3f& n,
                   uint32_t seed) const {
    const int all = std::max(2, options_.shadow_rays / 8);
    float sum = 0;
    int open = 0, hidden = 0, packets = 0;
    for (; packets < all; ++packets) {
      if (packets == 2 && (open == 0 || hidden == 0)) break;
      sum += shadowPacket(light, origin, n, seed, packets, open, hidden);
    }
    const float area = 4 * light.half_u * light.half_v;
    return sum * area / (8 * static_cast<float>(packets) * std::numbers::pi_v<float>);
  }

  float shadowPacket(const RectangleLight& light, const Vector3f& origin, const Vector3f& n,
                     uint32_t seed, int packet, int& open, int& hidden) const {
    // A packet covers a 4 x 2 (or 2 x 4) grid of cells with one shift for all. Packets come in
    // pairs with opposite shifts: what changes linearly over a cell cancels, and the light has no
    // mottle.
    const uint32_t bits = hash(seed + static_cast<uint32_t>(packet / 2) * 0x9E3779B9u);
    const bool mirrored = packet % 2 == 1, wide = packet / 2 % 2 == 0;
    const auto shift = [&](uint32_t b) { return mirrored ? 1 - fraction(b) : fraction(b); };
    const float shift_a = shift(bits), shift_b = shift(hash(bits));
    Float8 a, b;
    for (int i = 0; i < 8; ++i) {
      const int x = wide ? i % 4 : i % 2, y = wide ? i / 4 : i / 2;
      a[i] = 2 * (static_cast<float>(x) + shift_a) / (wide ? 4.f : 2.f) - 1;
      b[i] = 2 * (static_cast<float>(y) + shift_b) / (wide ? 2.f : 4.f) - 1;
    }
    const Vector8 from = simd::splat3(origin), normal = simd::splat3(light.normal);
    const RayPacket rays{from, simd::splat3(light.center) +
                                   simd::splat3(light.axis_u) * (a * light.half_u) +
                                   simd::splat3(light.axis_v) * (b * light.half_v) - from};
    const Float8 r2 = dot(rays.direction, rays.direction);
    const Float8 leaves = -dot(rays.direction, normal),
                 arrives = dot(rays.direction, simd::splat3(n));
    const Int8 facing = (leaves > 0.f) & (arrives > 0.f);
    if (simd::bits(facing) == 0) return 0;
    const Float8 end =
        simd::min(splat(0.998f), 1.f - light.body_m / simd::max(leaves, splat(1e-6f)));
    const Int8 blocked = scene_.bvh->occluded(rays, facing & (end > 0.f), splat(0.f), end, true);
    open += __builtin_popcount(static_cast<unsigned>(simd::bits(facing & ~blocked)));
    hidden += __builtin_popcount(static_cast<unsigned>(simd::bits(blocked)));
    return simd::sum(simd::select(facing & ~blocked, arrives * leaves / (r2 * r2), splat(0.f)));
  }

  void gather(int bounce) {
    const bool last = bounce == options_.bounces - 1;
    const int rays = (last ? options_.last_bounce_rays : options_.bounce_rays) / 8 * 8;
    std::vector<uint8_t> buried(bounced_.size(), 0);
    std::vector<Vector3f> next(bounced_.size());
    forPoints(next.size(), [&](size_t p) {
      int back_faces = 0;
      next[p] = gatheredLight(p, static_cast<uint32_t>(bounce), rays, back_faces);
      buried[p] = back_faces * 4 > rays;  // inside another solid
    });
    refill(bounce_grid_, buried, next);
    bounced_ = smoothed(bounce_grid_, last ? smoothed(bounce_grid_, next) : next);
    publish();
  }

  // The mean radiance over cosine-distributed directions (a Fibonacci pattern, turned per point).
  Vector3f gatheredLight(size_t p, uint32_t bounce, int rays, int& back_faces) const {
    const Vector3f& n = bounce_grid_.normals[p];
    const Vector3f origin = bounce_grid_.positions[p] + options_.surface_offset_m * n;
    const auto [tangent, bitangent] = basis(n);
    const uint32_t bits = hash(static_cast<uint32_t>(p) * 31u + bounce * 1013904223u);
    const float shift_u = fraction(bits), shift_v = fraction(hash(bits));
    Vector3f sum = Vector3f::Zero();
    for (int first = 0; first < rays; first += 8) {
      Float8 x, y, z;
      for (int i = 0; i < 8; ++i) {
        const auto q = static_cast<float>(first + i);
        const float u = (q + shift_u) / static_cast<float>(rays), radius = std::sqrt(u);
        const float angle = 2 * std::numbers::pi_v<float> * wrap(q * 0.61803399f + shift_v);
        x[i] = radius * std::cos(angle);
        y[i] = radius * std::sin(angle);
        z[i] = std::sqrt(std::max(0.f, 1 - u));
      }
      const RayPacket packet{
          simd::splat3(origin),
          simd::splat3(tangent) * x + simd::splat3(bitangent) * y + simd::splat3(n) * z};
      sum += gatherPacket(packet, back_faces);
    }
    return sum / static_cast<float>(rays);
  }

  Vector3f gatherPacket(const RayPacket& rays, int& back_faces) const {
    PacketHits hits = scene_.bvh->closest(rays, splat(-1), splat(0.f), false);
    const Int8 missed = ~hits.mask;
    const Int8 back = hits.mask & (dot(hits.normal, rays.direction) > 0.f);
    back_faces += __builtin_popcount(static_cast<unsigned>(simd::bits(back)));
    hits.mask &= ~back;
    Vector8 seen = simd::splat3(0, 0, 0);
    if (simd::bits(hits.mask)) {
      const Surface s = shading::surfaceAt<1>(scene_, rays, hits, splat(0.1f), 0.5f);
      Vector8 emission = s.emission;
      for (int i = 0; i < 8; ++i)
        if (hits.mask[i] && scene_.is_lamp[static_cast<size_t>(hits.triangle[i])])
          emission.x[i] = emission.y[i] = emission.z[i] = 0;
      seen = simd::select(hits.mask, s.albedo * s.light + emission, seen);
    }
    seen = simd::select(missed, simd::splat3(scene_.sky), seen);
    return {simd::sum(seen.x), simd::sum(seen.y), simd::sum(seen.z)};
  }

  // Direct plus bounced light at every sample, packed.
  void publish() {
    std::vector<Vector3f> values(direct_grid_.point_of_sample.size());
    forPoints(scene_.triangles.size(), [&](size_t k) {
      const int r = direct_grid_.resolution[k];
      auto s = static_cast<size_t>(direct_grid_.offset[k]);
      for (int j = 0; j <= r; ++j)
        for (int i = 0; i + j <= r; ++i, ++s)
          values[s] = direct_[direct_grid_.point_of_sample[s]] +
                      bounce_grid_.at(k, static_cast<float>(i) / static_cast<float>(r),
                                      static_cast<float>(j) / static_cast<float>(r), bounced_);
    });
    pack(values);
  }

  void pack(const std::vector<Vector3f>& values) {
    double mean = 0, greatest = 0;
    for (const Vector3f& v : values) {
      mean += static_cast<double>(v.mean());
      greatest = std::max(greatest, static_cast<double>(v.maxCoeff()));
    }
    mean /= static_cast<double>(std::max<size_t>(1, values.size()));
    LightMap& map = scene_.light;
    map.typical = static_cast<float>(std::max(mean, 1e-12));
    // Spots beside a lamp are cut: 11 bits must serve the rest.
    map.max = static_cast<float>(std::clamp(greatest, 1e-12, 30 * std::max(mean, 1e-12)));
    map.samples.resize(values.size());
    forPoints(values.size(), [&](size_t s) { map.samples[s] = packed(values[s], map.max); });
  }

  static uint32_t packed(const Vector3f& light, float max) {
    const auto quantise = [&](float x, float levels) {
      return static_cast<uint32_t>(std::lround(levels * std::sqrt(std::clamp(x / max, 0.f, 1.f))));
    };
    return quantise(light.x(), 2047) | quantise(light.y(), 2047) << 11 |
           quantise(light.z(), 1023) << 22;
  }

  RenderScene& scene_;
  const LightBakerOptions& options_;
  WorkerPool& pool_;
  LightGrid direct_grid_, bounce_grid_;
  std::vector<Vector3f> direct_, bounced_;  // irradiance / pi per point
};

}  // namespace

void bakeLight(RenderScene& scene, const LightBakerOptions& options, WorkerPool& pool) {
  Baker(scene, options, pool).run();
}

}  // namespace diorama
