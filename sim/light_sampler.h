// Estimates of the diffuse light that arrives at a point: rays to the area lights and over the
// hemisphere, eight at a time. Light is irradiance / pi everywhere.
#pragma once

#include <cstdint>
#include <functional>
#include <span>

#include "sim/bvh.h"
#include "sim/render_scene.h"

namespace diorama {

// Those of the active rays that do not arrive at t = end, where the light is.
using HiddenRays =
    std::function<simd::Int8(const RayPacket& rays, simd::Int8 active, simd::Float8 end)>;
// The radiance that comes from the rays' directions, area lights excepted. Adds the rays that meet
// the back of a face to back_faces.
using SeenRadiance = std::function<simd::Vector8(const RayPacket& rays, int& back_faces)>;

struct LitPoint {
  Vector3f position;  // m, a little above its surface
  Vector3f normal;    // unit
  uint32_t seed = 0;  // of the rays' pattern
};

// The light of area lights, with soft shadows: 16 stratified rays per light first, up to `rays`
// when they see the light in part.
Vector3f directLight(std::span<const RectangleLight> lights, const LitPoint& point, int rays,
                     const HiddenRays& hidden);

// The mean radiance over cosine-distributed directions. `rays` is a multiple of 8.
Vector3f gatheredLight(const LitPoint& point, int rays, const SeenRadiance& seen, int& back_faces);

}  // namespace diorama
