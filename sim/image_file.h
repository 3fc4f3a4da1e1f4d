// Images from files, checked before they are decoded.
#pragma once

#include <filesystem>
#include <variant>

#include "core/image.h"

namespace diorama {

using AnyImage = std::variant<Image<Rgb8>, Image<uint8_t>, Image<uint16_t>>;

// A colour or grey image of any format that OpenCV reads. Alpha is dropped; colour of 16 bits is
// rounded to 8, grey keeps its depth. Throws MissingInputError, or InputError when the file is
// broken (cut short, wrong checksum, not an image) or its size is not width x height.
AnyImage readImage(const std::filesystem::path& file, int width, int height);

}  // namespace diorama
