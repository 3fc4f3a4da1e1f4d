// The files of eval/report, built into the program.
#pragma once

#include <string_view>

namespace diorama {

// By the path below eval/report, for example "vendor/three.min.js"; a programming error when there
// is no such file.
std::string_view reportAsset(std::string_view name);

}  // namespace diorama
