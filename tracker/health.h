// How far a pose can be trusted.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "tracker/edge_search.h"
#include "tracker/texture_cue.h"

namespace diorama {

struct TrackHealth {
  double value = 0;           // in [0, 1]
  double edge_agreement = 0;  // share of visible samples with an agreeing edge, beyond chance
  std::string reason;         // why nothing can be said; empty otherwise
};

// Whether a pose with this covariance may be claimed.
bool isCertain(const Matrix6d& covariance, const TrackerOptions& options);

// Factor of a covariance that is not far from too large for a claim.
inline constexpr double kDoubted = 4;

// How far around a sample the health looks for edges, steps of its profile.
inline constexpr int kHealthRange = 6;

// Fewer patches tell nothing.
inline constexpr int kFewestPatches = 8;

// How many samples of the outline a sample counts for: whether a crease inside shows in the picture
// is up to the light.
inline constexpr double kCreaseWeight = 0.5;

struct VisibleSamples {
  size_t contour = 0;  // on the outline
  size_t crease = 0;   // inside
  // Of both kinds: the share where the surface looks as it did before.
  double familiar_share = 1;
};

// `observations` were made at the pose in question with kHealthRange; the patches, learned ones and
// those of the print, were linearised there.
TrackHealth assessHealth(const VisibleSamples& visible,
                         const std::vector<EdgeObservation>& observations,
                         const TextureCue& texture, const TextureCue& printed,
                         const TrackerOptions& options);

}  // namespace diorama
