// Where the surface points of one frame's pixels lie in another frame.
#pragma once

#include <cstdint>

#include "core/image.h"

namespace diorama {

struct FlowVector {
  float u = 0, v = 0;  // px
  friend bool operator==(const FlowVector&, const FlowVector&) = default;
};

enum class FlowState : uint8_t {
  kVisible = 0,        // seen in the other frame
  kHiddenByOther = 1,  // behind another object or the environment
  kHiddenBySelf = 2,   // behind another part of its own object, or on its far side
  kOutside = 3,        // beyond the other frame's image
  kNoSurface = 4       // nothing is hit here
};

struct FlowField {
  int from = 0, to = 0;  // frames
  // From the pixel's centre to the point's pixel in the other frame; 0 where the point does not
  // project there at all (it lies behind the camera) or there is no surface.
  Image<FlowVector> flow_px;
  Image<FlowState> state;
};

}  // namespace diorama
