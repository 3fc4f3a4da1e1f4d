// Finding the camera again after a loss: the frames that look most like this one, of the keyframes
// and the last good frames, give poses to try.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/measurements.h"
#include "vo/map.h"
#include "vo/tracking_quality.h"
#include "vo/vo_options.h"

namespace diorama::vo {

// Poses T_world_camera worth trying, the likeliest first. Each is that of a frame whose image is
// like this one, moved by sparse alignment; `last` is the last frame that had a pose.
std::vector<SE3> posesFromImages(const Camera& camera, const TrackedFrame& frame,
                                 const TrackedFrame& last, const Map& map,
                                 const VoOptions& options);

// The same from objects that the map knows and that are seen in this frame.
std::vector<SE3> posesFromObjects(std::span<const ObjectMeasurement> objects, const Map& map);

// Takes the frame to the first of these poses at which the map is seen as it should be.
Assessment findInMap(const Camera& camera, const Map& map, const std::vector<SE3>& poses,
                     TrackingQuality& quality, const VoOptions& options, TrackedFrame& frame);

}  // namespace diorama::vo
