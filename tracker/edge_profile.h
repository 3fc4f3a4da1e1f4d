// What an image shows along a line: grey values or colours, and the edges among them.
#pragma once

#include "core/frame.h"
#include "core/types.h"

namespace diorama {

// Grey values across an edge, along its projected normal.
struct Contrast {
  float gradient = 0;  // grey levels: half the height of the step, signed; 0 = never seen
  float before = 0;    // grey value 2.5 px before the edge
  float after = 0;     // ... and behind it
};

struct EdgeCandidate {
  double offset_px = 0;  // along the normal from the projected sample
  Contrast contrast;
  bool like_before = true;  // one side looks as remembered
};

inline bool strongerEdge(const EdgeCandidate& a, const EdgeCandidate& b) {
  return std::abs(a.contrast.gradient) > std::abs(b.contrast.gradient);
}

// What is searched for edges: a view of grey values, and of colours where the camera has them.
struct EdgePicture {
  EdgePicture(const Image<uint8_t>& grey_values) : grey(&grey_values) {}
  EdgePicture(const Frame& frame) : grey(&frame.gray) {
    if (frame.rgb.width == frame.gray.width && frame.rgb.height == frame.gray.height)
      rgb = &frame.rgb;
  }
  const Image<uint8_t>* grey;
  const Image<Rgb8>* rgb = nullptr;
};

// Values along a line with a spacing of one step, mostly 1 px, averaged over some parallels. The
// first and last kMargin values are margin; offset 0 is the middle.
struct EdgeProfile {
  static constexpr int kMargin = 3;     // px on each side, for the derivative and the grey values
  static constexpr int kMaxRange = 32;  // px; the paper's maximum error
  static constexpr int kMaxLength = 2 * (kMaxRange + kMargin) + 1;

  int length = 0;
  float grey[kMaxLength];   // levels; what is beside an edge
  float value[kMaxLength];  // levels in which edges are sought
  float light[kMaxLength];  // in which they are placed, about the square of the levels
};

// The profile across `u_px` in steps of `step_px`, from -range to range of them. The caller
// has made sure that it lies in the image, with a margin of 2 px.
void readGreyProfile(const Image<uint8_t>& image, const Vector2d& u_px, const Vector2d& step_px,
                     int range, EdgeProfile& profile);

// Changes `value` and `light` of a grey profile to the difference of colours that its greatest
// change of colour is made of: surfaces as bright as one another still differ in colour.
void readColorProfile(const Image<Rgb8>& image, const Vector2d& u_px, const Vector2d& step_px,
                      EdgeProfile& profile);

// Sub-pixel places of intensity edges in a profile: extrema of the smoothed derivative of `value`
// above min_gradient. They are placed by the light, which pixels and motion blur mix linearly; a
// ramp on one side, a contact shadow or a rounded rim, has drawn the extremum its way, and is
// allowed for (docs/adr/0010-edges-in-light.md).
// Appends at most `capacity` candidates, the strongest.
int findProfileEdges(const EdgeProfile& profile, float min_gradient, EdgeCandidate* out,
                     int capacity);

}  // namespace diorama
