// Models and environments by the names that scenes give them.
#pragma once

#include <filesystem>

#include "core/yaml.h"

namespace diorama {

// A folder under dataFolder()/models by its name, or a path relative to the scene. Throws
// MissingInputError with the nearest known name.
std::filesystem::path findModel(const YamlValue& value, const std::filesystem::path& scene_folder);
std::filesystem::path findEnvironment(const YamlValue& value,
                                      const std::filesystem::path& scene_folder);

}  // namespace diorama
