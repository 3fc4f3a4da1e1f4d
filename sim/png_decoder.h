// Reads the usual kinds of PNG, of which `run` reads one for every frame: half the time of OpenCV,
// whose zlib is the slower one.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <variant>

#include "core/image.h"

namespace diorama {

// 8-bit grey and colour, 16-bit grey; without interlacing and transparency. Nothing for other kinds
// and for what is broken: whoever calls tries another reader, which says what is wrong. Checksums
// of chunks are not looked at, that of the pixels is.
using PngImage = std::variant<Image<uint8_t>, Image<uint16_t>, Image<Rgb8>>;
std::optional<PngImage> decodePng(std::string_view bytes);

}  // namespace diorama
