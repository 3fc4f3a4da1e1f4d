// When a frame becomes a keyframe, and which one goes when there are too many.
#pragma once

#include "vo/map.h"
#include "vo/vo_options.h"

namespace diorama::vo {

// The camera has moved far from every keyframe that looks the same way, or features get few.
bool needsKeyframe(const Map& map, const TrackedFrame& frame, const VoOptions& options);

// The keyframe farthest from the frame, never one of the newest `window`; null when there is no
// other.
Keyframe* farthestKeyframe(const Map& map, const TrackedFrame& frame, int window);

}  // namespace diorama::vo
