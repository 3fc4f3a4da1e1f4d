// The similarity that lays one set of points over another best: S. Umeyama, Least-squares
// estimation of transformation parameters between two point patterns, PAMI 1991.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "core/se3.h"

namespace diorama {

enum class Alignment { kNone, kSE3, kSim3 };

std::optional<Alignment> alignmentFromString(const std::string& name);  // none, se3, sim3

// p_target = scale * R * p_source + t.
struct Similarity {
  SE3 T_target_source;
  double scale = 1;
};

// Minimises sum |target - (scale * R * source + t)|^2. Always gives a minimiser, also where it is
// not the only one: one point or coincident points leave rotation and scale as they are, points on
// a line leave the rotation about it open. The two lists must have the same length; identity for
// none.
Similarity umeyama(std::span<const Vector3d> source, std::span<const Vector3d> target,
                   Alignment alignment);

}  // namespace diorama
