// A start on trial: two frames do not tell a camera that moves from a thing that moves with it, a
// board held before the lens; what the objects say in the frames that follow does.
#pragma once

#include <deque>
#include <optional>
#include <span>

#include "core/measurements.h"
#include "vo/map.h"
#include "vo/vo_options.h"

namespace diorama::vo {

// Squared distance, in standard deviations of the measurement, between where an object of the map
// is seen and where the camera's pose has it; of several that which agrees best, since objects may
// move by themselves. Nothing when none is seen.
std::optional<double> discrepancy(const Map& map, const SE3& T_world_camera,
                                  std::span<const ObjectMeasurement> objects,
                                  const VoOptions& options);

// The same of what the keyframe itself saw.
std::optional<double> discrepancy(const Map& map, const Keyframe& keyframe);

// Chi-square, 6 dof: 99.9% of right ones are nearer.
inline bool contradicts(double discrepancy) { return discrepancy > 22.5; }

class StartTrial {
 public:
  explicit StartTrial(const VoOptions& options) : options_(options) {}

  void begin() { frames_ = 0, recent_.clear(); }
  // One frame.
  void add(std::optional<double> discrepancy);

  // After so many frames, of the last of which one at most contradicts: what moves with the camera
  // takes its time to be told.
  bool over() const;
  // The objects contradict the map in most of the last frames.
  bool refuted() const;

 private:
  size_t contradictions() const;

  const VoOptions& options_;
  int frames_ = 0;
  std::deque<double> recent_;
};

}  // namespace diorama::vo
