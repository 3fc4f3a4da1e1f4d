#include "tracker/health.h"

#include <algorithm>
#include <cmath>

namespace diorama {
namespace {

constexpr int kFewestPatches = 8;
constexpr double kWithoutTexture = 0.5;  // factor when no patch agrees

// Whether a familiar edge lies within `radius` of a place along the normal.
bool hasEdgeAt(const EdgeObservation& o, double place_px, double radius_px) {
  for (int k = 0; k < o.candidate_count; ++k) {
    const EdgeCandidate& c = o.candidates[static_cast<size_t>(k)];
    if (c.like_before && std::abs(c.offset_px - place_px) < radius_px) return true;
  }
  return false;
}

}  // namespace

TrackHealth assessHealth(size_t visible_samples, const std::vector<EdgeObservation>& observations,
                         const TextureCue& texture, const TrackerOptions& options) {
  TrackHealth health;
  if (visible_samples < static_cast<size_t>(options.min_samples)) {
    health.reason = "too few edges of the object are in the image";
    return health;
  }
  // In clutter and print some edge is near any line: what is found beside the expected place tells
  // how much of what is found there is chance.
  const double radius = options.inlier_px, beside = kHealthRange - radius;
  double at_place = 0, by_chance = 0;
  for (const EdgeObservation& o : observations) {
    at_place += hasEdgeAt(o, 0, radius);
    by_chance += 0.5 * (hasEdgeAt(o, beside, radius) + hasEdgeAt(o, -beside, radius));
  }
  const double n = static_cast<double>(visible_samples);
  health.edge_agreement = std::max(0.0, (at_place - by_chance) / std::max(1.0, n - by_chance));
  const TextureCue::Agreement patches = texture.agreement(options.inlier_px);
  if (patches.expected >= kFewestPatches)
    health.texture_agreement = patches.agreeing / static_cast<double>(patches.expected);
  // Texture that disagrees is a warning; that it agrees proves little, for it may have been learned
  // on a wrong pose.
  health.value = health.edge_agreement;
  if (health.texture_agreement >= 0)
    health.value *= std::min(1.0, kWithoutTexture + health.texture_agreement);
  return health;
}

}  // namespace diorama
