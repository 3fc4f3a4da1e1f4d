// How far a pose can be trusted.
#pragma once

#include <string>
#include <vector>

#include "tracker/edge_search.h"
#include "tracker/texture_cue.h"

namespace diorama {

struct TrackHealth {
  double value = 0;               // in [0, 1]
  double edge_agreement = 0;      // samples with an agreeing edge, over visible samples
  double texture_agreement = -1;  // patches that agree, over expected ones; -1 = too few to tell
  std::string reason;             // why the value is low; empty when it is not
};

// `observations` hold the residuals of the last linearisation.
TrackHealth assessHealth(size_t visible_samples, const std::vector<EdgeObservation>& observations,
                         const TextureCue& texture, const TrackerOptions& options);

}  // namespace diorama
