// Where the colour samples of a pixel lie, in the pixel and in the exposure time.
#pragma once

#include <vector>

#include "core/types.h"
#include "sim/renderer.h"

namespace diorama {

struct PixelSample {
  float du = 0, dv = 0;  // from the pixel centre, px
  Vector3f origin;       // of the camera at the sample's moment, world, m
  Vector3f axis_x, axis_y, axis_z;
  float dither =
      0;  // in [0, 1): between two mip levels; the same for samples that mirror each other
};

struct SamplePattern {
  std::vector<PixelSample> base;   // for every pixel
  std::vector<PixelSample> extra;  // as many again, where an edge needs them; may be empty
  float footprint = 1;             // of one sample, px
};

// `count` is 4, 8, 16 or 32: each sample has a row, a column and a moment of its own.
SamplePattern makeSamplePattern(int count, bool extra, const ExposureMotion& motion);

}  // namespace diorama
