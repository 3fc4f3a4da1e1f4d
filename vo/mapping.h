// What happens behind a tracked frame, and need not be done before the next one comes: depths,
// keyframes, adjustment. Owns the map.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "core/measurements.h"
#include "vo/depth_filter.h"
#include "vo/object_scale.h"

namespace diorama::vo {

struct MapUpdate {
  bool adjusted = false;  // the frame became a keyframe, and its pose was corrected with the map
  double stretched = 1;   // all lengths, when the scale became known in this frame
  std::string stretched_by;
};

class Mapping {
 public:
  Mapping(const Camera& camera, const VoOptions& options)
      : camera_(camera), options_(options), scale_(options), depth_filter_(options) {}

  Map& map() { return map_; }
  const Map& map() const { return map_; }

  // Goes on from a map that initialisation has filled.
  void begin(bool metric);

  // Takes what is seen of objects that move from the frame, and their points from the map.
  void leaveOutMoving(TrackedFrame& frame);

  // The frame is the newest one with a good pose, and of this health. Its pose is changed with the
  // map, and features of points that are no more are taken from it.
  MapUpdate update(TrackedFrame& frame, double acceleration,
                   std::span<const ObjectMeasurement> objects);

  bool isMetric() const { return scale_.begun(); }
  // Relative, of all lengths, since objects tell the scale of a start without it; 0 when it is
  // known, nothing before.
  std::optional<double> scaleSigma() const {
    return isMetric() ? std::optional(scale_.sigma()) : std::nullopt;
  }
  bool wantsObjects(int64_t now_ns) const { return scale_.wantsObjects(now_ns); }

 private:
  bool isCovered(const TrackedFrame& frame);
  void leaveOutUnsettled(TrackedFrame& frame) const;
  int recentKeyframes() const;
  void makeRoom(TrackedFrame& frame);
  MapUpdate addKeyframe(TrackedFrame& frame, double acceleration,
                        std::span<const ObjectMeasurement> objects);
  double learnScale(const TrackedFrame& frame);
  void forgetBadPoints(TrackedFrame& frame);

  const Camera& camera_;
  const VoOptions& options_;
  Map map_;
  ScaleLearning scale_;
  DepthFilter depth_filter_;
  std::optional<int64_t> covered_since_ns_;
};

}  // namespace diorama::vo
