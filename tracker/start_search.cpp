#include "tracker/start_search.h"

#include <vector>

namespace diorama {

Estimate searchFromStart(const SE3& start, const std::optional<PosePrior>& prior,
                         uint32_t frame_index, bool look_is_known, const TrackerOptions& options,
                         PoseRefiner& refiner, const ParticleFilter& filter) {
  Estimate best = refiner.refineStart(start, prior);
  // A start that the image leaves where it was needs no comparison, but with its neighbours where
  // it knows little; with good grey values the rescue does as well, and costs less.
  const bool kept = best.health.value >= options.start_health &&
                    refiner.pixelMotion(best.T_camera_model, start) < options.narrow_search_px;
  if (kept && isCertain(kDoubted * best.covariance, options)) return best;
  if (kept || best.health.value >= options.certain_health || options.filter.start_particles == 0 ||
      look_is_known)
    return refiner.searchNeighbours(best, prior);
  const std::vector<int> ranges{options.filter.start_search_px, options.filter.search_px};
  const auto judge = [&](const SE3& T) {
    return refiner.judge(T, refiner.visibleSamples(T, options.filter.max_samples), ranges);
  };
  const std::vector<SE3> found = filter.anneal(start, judge, frame_index);
  for (size_t k = 0; k < found.size() && k < static_cast<size_t>(options.filter.start_finalists);
       ++k) {
    Estimate other = refiner.refine(found[k], prior);
    if (other.fit > best.fit) best = std::move(other);
  }
  return refiner.searchNeighbours(best, prior);
}

}  // namespace diorama
