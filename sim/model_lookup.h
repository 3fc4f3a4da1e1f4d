// Models and environments by the names that scenes give them.
#pragma once

#include <filesystem>

#include "core/yaml.h"

namespace diorama {

// A folder under dataFolder()/models by its name, or a path relative to the scene. Throws
// MissingInputError with the nearest known name.
std::filesystem::path findModel(const YamlValue& value, const std::filesystem::path& scene_folder);
// The same for a name that a user gave on the command line; paths are relative to the working
// directory.
std::filesystem::path findModel(const std::string& name);
std::filesystem::path findEnvironment(const YamlValue& value,
                                      const std::filesystem::path& scene_folder);

}  // namespace diorama
