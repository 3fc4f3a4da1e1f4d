// From a given pose to the object.
#pragma once

#include <cstdint>
#include <optional>

#include "tracker/particle_filter.h"
#include "tracker/pose_refiner.h"

namespace diorama {

// Directly, and where that does not end beyond doubt, by annealed particles around it; not when
// `look_is_known`: round things have many poses that look right.
Estimate searchFromStart(const SE3& start, const std::optional<PosePrior>& prior,
                         uint32_t frame_index, bool look_is_known, const TrackerOptions& options,
                         PoseRefiner& refiner, const ParticleFilter& filter);

}  // namespace diorama
