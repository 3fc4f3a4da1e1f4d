#include "vo/start_trial.h"

#include <algorithm>

#include "vo/object_scale.h"

namespace diorama::vo {
namespace {

constexpr size_t kFewestSeen = 4;  // frames
constexpr size_t kRemembered = 8;  // frames

}  // namespace

std::optional<double> discrepancy(const Map& map, const SE3& T_world_camera,
                                  std::span<const ObjectMeasurement> objects,
                                  const VoOptions& options) {
  std::optional<double> smallest;
  for (const ObjectMeasurement& m : objects) {
    const auto known = std::find_if(map.objects.begin(), map.objects.end(),
                                    [&](const MapObject& o) { return o.name == m.object; });
    if (known == map.objects.end() || !isUsable(m)) continue;
    const Vector6d r = objectResidual(T_world_camera, known->T_world_object, m.T_camera_object).r;
    const double square = r.dot(covarianceOf(m, options).llt().solve(r));
    smallest = std::min(square, smallest.value_or(square));
  }
  return smallest;
}

std::optional<double> discrepancy(const Map& map, const Keyframe& keyframe) {
  std::optional<double> smallest;
  for (const ObjectObservation& o : keyframe.objects) {
    const Vector6d r = objectResidual(keyframe.T_world_camera, map.objects[o.object].T_world_object,
                                      o.T_camera_object)
                           .r;
    const double square = r.dot(o.information * r);
    smallest = std::min(square, smallest.value_or(square));
  }
  return smallest;
}

void StartTrial::add(std::optional<double> discrepancy) {
  ++frames_;
  if (!discrepancy) return;
  recent_.push_back(*discrepancy);
  if (recent_.size() > kRemembered) recent_.pop_front();
}

bool StartTrial::over() const {
  if (options_.start_trial_frames == 0) return true;
  return frames_ >= options_.start_trial_frames && contradictions() <= 1;
}

bool StartTrial::refuted() const {
  return options_.start_trial_frames > 0 && recent_.size() >= kFewestSeen &&
         2 * contradictions() > recent_.size();
}

// Among the frames that are remembered.
size_t StartTrial::contradictions() const {
  return static_cast<size_t>(std::count_if(recent_.begin(), recent_.end(), contradicts));
}

}  // namespace diorama::vo
