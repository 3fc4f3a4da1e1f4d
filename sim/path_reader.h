// The camera path of a scene file.
#pragma once

#include <filesystem>
#include <memory>

#include "core/yaml.h"
#include "sim/motion_path.h"

namespace diorama {

// The key `path`; files are relative to `folder`. Throws MissingInputError or InputError.
std::shared_ptr<const MotionPath> readPath(const YamlValue& value,
                                           const std::filesystem::path& folder);

}  // namespace diorama
