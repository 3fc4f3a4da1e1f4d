// The key `occlude` of a scene file.
//
//   occlude: {object: NAME, occluder: hand|board|pole|box, visible_fraction: [[t, fraction], ...],
//             from: right|left|below|above, distance_m, name}       or a list of such
//   `from`, `distance_m` (from the camera) and `name` are chosen when they are not there.
#pragma once

#include <vector>

#include "core/yaml.h"
#include "sim/occlusion.h"

namespace diorama {

// Throws InputError.
std::vector<OcclusionRequest> readOcclusions(const YamlValue& value, const Scene& scene);

}  // namespace diorama
