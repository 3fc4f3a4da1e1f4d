// The start of a camera that only turns: its first points are the corners on known objects.
#pragma once

#include <span>

#include "vo/initialisation.h"
#include "vo/object_surfaces.h"

namespace diorama::vo {

// For when the first keyframe of `initialisation` has led nowhere. If the image has moved since
// then, and as the objects say that the camera has, fills the map with `frame` as its only keyframe
// and the corners whose depth the objects tell. It fails with fewer than a dozen.
StartAttempt startFromSurfaces(const Camera& camera, const Initialisation& initialisation,
                               const TrackedFrame& frame,
                               std::span<const ObjectMeasurement> objects,
                               const ObjectSurfaces& surfaces, const VoOptions& options, Map& map);

}  // namespace diorama::vo
