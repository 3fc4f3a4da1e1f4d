// What JPEG coding makes of a picture.
#pragma once

#include "core/image.h"

namespace diorama {

// Coded with a quality from 1 to 100 and decoded again: blocks, ringing, half the colour's
// resolution.
Image<Rgb8> throughJpeg(const Image<Rgb8>& picture, int quality);

}  // namespace diorama
