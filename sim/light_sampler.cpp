#include "sim/light_sampler.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace diorama {

using simd::Float8;
using simd::Int8;
using simd::splat;
using simd::Vector8;

namespace {

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

// Eight rays to places on a light. A packet covers a 4 x 2 (or 2 x 4) grid of cells with one shift
// for all. Packets come in pairs with opposite shifts: what changes linearly over a cell cancels,
// and the light has no mottle.
RayPacket raysToLight(const RectangleLight& light, const LitPoint& point, uint32_t seed,
                      int packet) {
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
  const Vector8 from = simd::splat3(point.position);
  return {from, simd::splat3(light.center) + simd::splat3(light.axis_u) * (a * light.half_u) +
                    simd::splat3(light.axis_v) * (b * light.half_v) - from};
}

struct LightPackets {
  float sum = 0;  // of cos cos / r^2 over the rays that arrive
  int open = 0, hidden = 0;
};

void addPacket(const RectangleLight& light, const LitPoint& point, const RayPacket& rays,
               const HiddenRays& hidden_rays, LightPackets& result) {
  const Float8 r2 = dot(rays.direction, rays.direction);
  const Float8 leaves = -dot(rays.direction, simd::splat3(light.normal)),
               arrives = dot(rays.direction, simd::splat3(point.normal));
  const Int8 facing = (leaves > 0.f) & (arrives > 0.f);
  if (simd::bits(facing) == 0) return;
  const Float8 end = simd::min(splat(0.998f), 1.f - light.body_m / simd::max(leaves, splat(1e-6f)));
  const Int8 hidden = hidden_rays(rays, facing & (end > 0.f), end);
  const Int8 open = facing & ~hidden;
  result.open += __builtin_popcount(static_cast<unsigned>(simd::bits(open)));
  result.hidden += __builtin_popcount(static_cast<unsigned>(simd::bits(hidden)));
  result.sum += simd::sum(simd::select(open, arrives * leaves / (r2 * r2), splat(0.f)));
}

// Integral of visible cos cos / r^2 dA / pi over the light.
float formFactor(const RectangleLight& light, const LitPoint& point, uint32_t seed, int most_rays,
                 const HiddenRays& hidden) {
  const int most = std::max(2, most_rays / 8);
  LightPackets result;
  int packets = 0;
  for (; packets < most; ++packets) {
    if (packets == 2 && (result.open == 0 || result.hidden == 0)) break;
    addPacket(light, point, raysToLight(light, point, seed, packets), hidden, result);
  }
  const float area = 4 * light.half_u * light.half_v;
  return result.sum * area / (8 * static_cast<float>(packets) * std::numbers::pi_v<float>);
}

}  // namespace

Vector3f directLight(std::span<const RectangleLight> lights, const LitPoint& point, int rays,
                     const HiddenRays& hidden) {
  Vector3f sum = Vector3f::Zero();
  for (size_t l = 0; l < lights.size(); ++l) {
    const uint32_t seed = hash(point.seed + static_cast<uint32_t>(l) * 7919u);
    sum += lights[l].radiance * formFactor(lights[l], point, seed, rays, hidden);
  }
  return sum;
}

Vector3f gatheredLight(const LitPoint& point, int rays, const SeenRadiance& seen, int& back_faces) {
  const Vector3f& n = point.normal;
  const auto [tangent, bitangent] = basis(n);
  const uint32_t bits = hash(point.seed);
  const float shift_u = fraction(bits), shift_v = fraction(hash(bits));
  Vector3f sum = Vector3f::Zero();
  for (int first = 0; first < rays; first += 8) {
    Float8 x, y, z;
    for (int i = 0; i < 8; ++i) {  // a Fibonacci pattern, turned per point
      const auto q = static_cast<float>(first + i);
      const float u = (q + shift_u) / static_cast<float>(rays), radius = std::sqrt(u);
      const float angle = 2 * std::numbers::pi_v<float> * wrap(q * 0.61803399f + shift_v);
      x[i] = radius * std::cos(angle);
      y[i] = radius * std::sin(angle);
      z[i] = std::sqrt(std::max(0.f, 1 - u));
    }
    const Vector8 light =
        seen({simd::splat3(point.position),
              simd::splat3(tangent) * x + simd::splat3(bitangent) * y + simd::splat3(n) * z},
             back_faces);
    sum += Vector3f(simd::sum(light.x), simd::sum(light.y), simd::sum(light.z));
  }
  return sum / static_cast<float>(rays);
}

}  // namespace diorama
