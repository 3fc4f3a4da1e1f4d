// The objects of a scene file, and where they stand.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "core/yaml.h"
#include "sim/scene.h"

namespace diorama {

// A level rectangle that things can be put on.
struct Surface {
  double z = 0;
  double x_min = 0, x_max = 0, y_min = 0, y_max = 0;
};
using Surfaces = std::map<std::string, Surface>;

// Appends the list `objects` to the scene. Each has a pose, a path, or lies `on` a surface or an
// object that stands before it. Throws MissingInputError or InputError, also when two of them stand
// in one another.
void readObjects(const YamlValue& list, const std::filesystem::path& folder,
                 const Surfaces& surfaces, Scene& scene);

// Values that are each in range can still make a path beyond all bounds: an InputError.
void checkPath(const MotionPath& path, const Scene& scene, const YamlValue& place);

}  // namespace diorama
