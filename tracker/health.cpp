#include "tracker/health.h"

#include <algorithm>
#include <cmath>

namespace diorama {
namespace {

constexpr double kWithoutTexture = 0.5;  // factor when no patch agrees
// So many patches of print make up for half of what the edges lack.
constexpr double kManyPatches = 16, kByPrint = 0.5;

constexpr double kNear = 1;  // steps, of an edge that agrees; fitted poses are nearer

// The strongest familiar edge within kNear of a place along the normal, of those that are at least
// so strong; 0 when there is none.
float edgeAt(const EdgeObservation& o, double place, float least) {
  float strongest = 0;
  for (int k = 0; k < o.candidate_count; ++k) {
    const EdgeCandidate& c = o.candidates[static_cast<size_t>(k)];
    const float strength = std::abs(c.contrast.gradient);
    if (c.like_before && std::abs(c.offset_px / o.step_px - place) < kNear && strength >= least)
      strongest = std::max(strongest, strength);
  }
  return strongest;
}

}  // namespace

bool isCertain(const Matrix6d& covariance, const TrackerOptions& options) {
  return std::sqrt(covariance.topLeftCorner<3, 3>().trace()) <= options.claim_sigma_m &&
         std::sqrt(covariance.bottomRightCorner<3, 3>().trace()) <= options.claim_sigma_rad;
}

TrackHealth assessHealth(const VisibleSamples& visible,
                         const std::vector<EdgeObservation>& observations,
                         const TextureCue& texture, const TextureCue& printed,
                         const TrackerOptions& options) {
  TrackHealth health;
  if (visible.contour + visible.crease < static_cast<size_t>(options.min_samples)) {
    health.reason = "too few edges of the object are in the image";
    return health;
  }
  // In clutter and print some edge is near any line: what is found beside the expected place tells
  // how much of what is found there is chance. A weaker one beside it tells nothing about an edge:
  // wood grain beside an outline, or shading.
  const double beside = kHealthRange - kNear;
  double at_place = 0, by_chance = 0;
  for (const EdgeObservation& o : observations) {
    const double weight = o.contour ? 1 : kCreaseWeight;
    const float found = edgeAt(o, 0, 0);
    at_place += weight * (found > 0);
    by_chance += 0.5 * weight * ((edgeAt(o, beside, found) > 0) + (edgeAt(o, -beside, found) > 0));
  }
  const double n =
      static_cast<double>(visible.contour) + kCreaseWeight * static_cast<double>(visible.crease);
  health.edge_agreement = std::max(0.0, (at_place - by_chance) / std::max(1.0, n - by_chance));
  health.value =
      health.edge_agreement * std::min(1.0, visible.familiar_share / options.enough_uncovered);
  // Texture that disagrees is a warning; that it agrees proves little, for it may have been learned
  // on a wrong pose.
  const TextureCue::Agreement learned = texture.agreement(options.inlier_px);
  if (learned.expected >= kFewestPatches)
    health.value *=
        std::min(1.0, kWithoutTexture + learned.agreeing / static_cast<double>(learned.expected));
  // Print was not: some of it is proof, however much of the rest is covered.
  const TextureCue::Agreement print = printed.agreement(options.inlier_px);
  if (print.expected >= kFewestPatches) {
    health.value *= std::min(1.0, kWithoutTexture + print.agreeing / double{kFewestPatches});
    health.value += (1 - health.value) * kByPrint * std::min(1.0, print.agreeing / kManyPatches);
  }
  return health;
}

}  // namespace diorama
