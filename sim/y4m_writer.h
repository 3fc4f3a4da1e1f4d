// YUV4MPEG2: an uncompressed stream that ffmpeg, mpv and many others read from a pipe.
#pragma once

#include <string>

#include "core/image.h"

namespace diorama {

// The line that begins a stream: progressive, square pixels, 4:4:4, full range. The rate is written
// as a fraction of thousandths.
std::string y4mHeader(int width, int height, double rate_hz);

// A frame: Y, Cb and Cr in full size, ITU-R BT.601 with the full range of 0 to 255 (as JPEG).
std::string y4mFrame(const Image<Rgb8>& image);

}  // namespace diorama
