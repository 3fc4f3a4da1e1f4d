#include "tracker/health.h"

#include <algorithm>
#include <cmath>

namespace diorama {
namespace {

constexpr int kFewestPatches = 8;

}  // namespace

TrackHealth assessHealth(size_t visible_samples, const std::vector<EdgeObservation>& observations,
                         const TextureCue& texture, const TrackerOptions& options) {
  TrackHealth health;
  if (visible_samples < static_cast<size_t>(options.min_samples)) {
    health.reason = "too few edges of the object are in the image";
    return health;
  }
  int agreeing = 0;
  for (const EdgeObservation& o : observations)
    if (o.chosen >= 0 && std::abs(o.residual_px) < options.inlier_px)
      agreeing += o.candidates[static_cast<size_t>(o.chosen)].like_before;
  health.edge_agreement = agreeing / static_cast<double>(visible_samples);
  const TextureCue::Agreement patches = texture.agreement(options.inlier_px);
  if (patches.expected >= kFewestPatches)
    health.texture_agreement = patches.agreeing / static_cast<double>(patches.expected);
  // Agreeing texture makes up for hidden edges; texture that disagrees may only be blurred.
  const double both = 0.5 * (health.edge_agreement + health.texture_agreement);
  health.value = std::max(health.edge_agreement, both);
  return health;
}

}  // namespace diorama
