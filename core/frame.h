// One image of a sequence. It carries no ground truth: estimators see only this.
#pragma once

#include <cstdint>

#include "core/image.h"

namespace diorama {

struct Frame {
  int index = 0;             // in the sequence, from 0
  int64_t timestamp_ns = 0;  // mid-exposure, a whole number of microseconds
  Image<Rgb8> rgb;           // empty for a grey camera
  Image<uint8_t> gray;
};

}  // namespace diorama
