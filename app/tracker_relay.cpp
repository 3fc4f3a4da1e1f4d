#include "app/tracker_relay.h"

#include <algorithm>

#include "core/errors.h"

namespace diorama {

TrackerRelay::TrackerRelay(std::vector<std::unique_ptr<ObjectTracker>> trackers) {
  DIORAMA_CHECK(!trackers.empty());
  for (auto& tracker : trackers) runners_.push_back({std::move(tracker)});
}

ObjectMeasurement TrackerRelay::track(const Frame& frame,
                                      const std::optional<ObjectPrediction>& start) {
  std::vector<std::optional<ObjectMeasurement>> said(runners_.size());
  const auto claimed = [](const auto& m) { return m && m->claimed; };
  for (size_t i = 0; i < runners_.size(); ++i)
    if (runners_[i].holds || start) said[i] = runners_[i].tracker->track(frame, start);
  const auto holder = std::find_if(said.begin(), said.end(), claimed);
  std::optional<ObjectPrediction> found;
  if (holder != said.end())
    found = ObjectPrediction{(*holder)->T_camera_object, (*holder)->covariance};
  for (size_t i = 0; i < runners_.size(); ++i) {
    if (!said[i]) said[i] = runners_[i].tracker->track(frame, found);
    runners_[i].holds = said[i]->claimed;
  }
  const auto first = std::find_if(said.begin(), said.end(), claimed);
  return first != said.end() ? **first : *said.front();
}

}  // namespace diorama
