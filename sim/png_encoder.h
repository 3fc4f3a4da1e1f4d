// A PNG encoder for rendered sequences: fast, and the same bytes on every machine and with every
// version of the image libraries.
//
// Rows are filtered (average of left and up for colour and grey pictures, up for ids, masks and
// depth); the result is one deflate block with a Huffman code of its own in which only runs that
// repeat the pixel before are matches (RFC 1951; ISO/IEC 15948). Noisy pictures gain nothing from
// searching for more.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/image.h"

namespace diorama {

enum class PngContent { kPicture, kLabels };

std::string encodePng(const Image<Rgb8>& image);  // 8 bit colour
std::string encodePng(const Image<uint8_t>& image, PngContent content = PngContent::kPicture);
std::string encodePng(const Image<uint16_t>& image);  // 16 bit grey, labels or depth
std::string encodePng(const Image<Rgb16>& image);     // 16 bit colour

// CRC-32 of a chunk's type and content.
uint32_t pngChecksum(std::string_view bytes);

}  // namespace diorama
