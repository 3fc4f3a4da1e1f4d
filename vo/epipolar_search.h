// The depth of a corner from a second view: search along the epipolar line, then feature alignment.
#pragma once

#include <optional>

#include "vo/map.h"
#include "vo/vo_options.h"

namespace diorama::vo {

// A corner whose depth is being estimated.
struct Corner3d {
  Keyframe* host = nullptr;
  Vector2d u_px;
  Vector3d bearing;  // z = 1
  int level = 0;
  bool edgelet = false;
};

struct InverseDepth {
  double value = 0;  // 1 / z in the host, 1/m
  double sigma = 0;  // from how well the match is located
};

enum class EpipolarOutcome { kFound, kNotVisible, kNoMatch };

struct EpipolarMatch {
  EpipolarOutcome outcome = EpipolarOutcome::kNotVisible;
  InverseDepth depth;
};

// Searches between two inverse depths, `low` below `high`; of a line longer than max_epipolar_px
// only the middle. kNotVisible says nothing about the depth: the line cannot be seen.
EpipolarMatch searchEpipolar(const Camera& camera, const Corner3d& corner,
                             const TrackedFrame& frame, double low, double high,
                             const VoOptions& options);

// Inverse depth in the host of a point seen along `bearing` in the host and `bearing_other` in the
// other camera (both z = 1), by least squares in the other's normalised plane; nothing without a
// baseline or behind a camera. `error` is what remains between the rays, in the normalised plane.
struct Triangulated {
  double inverse_depth = 0, sensitivity = 0,
         error = 0;  // sensitivity: d inverse depth / d position
};
std::optional<Triangulated> triangulate(const SE3& T_other_host, const Vector3d& bearing,
                                        const Vector3d& bearing_other);

}  // namespace diorama::vo
