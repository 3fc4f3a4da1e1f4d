// Single rays against all of a scene at the moment of a row: what rests, and what moves where it
// then is.
#pragma once

#include <array>
#include <memory>

#include "sim/frame_geometry.h"
#include "sim/render_scene.h"

namespace diorama {

struct TimedRay {
  Vector3d origin, direction;  // world, m; the direction of any length
  double row = 0;              // whose time it is
};

struct SceneHit {
  float t = 0;       // in lengths of the direction; 0: nothing is hit
  int instance = 0;  // as in the truth
  Vector3d normal;   // world, of any length and side
};

// Eight at a time: they are traced together.
constexpr int kRaysTogether = 8;
using TimedRays = std::array<TimedRay, kRaysTogether>;
using SceneHits = std::array<SceneHit, kRaysTogether>;

// The nearest surface along each of the rays whose bit is set in `active`. Thread-safe.
SceneHits closestHits(const RenderScene& scene, const FrameGeometry& frame, const TimedRays& rays,
                      int active);

}  // namespace diorama
