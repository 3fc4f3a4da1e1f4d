// Where the colour samples of a pixel lie, in the pixel and in the exposure time.
#pragma once

#include <vector>

#include "sim/renderer.h"
#include "sim/simd.h"

namespace diorama {

// Two samples of a 2 x 2 block of pixels: lanes 0-3 belong to the first, 4-7 to the second.
struct SamplePair {
  simd::Float8 du, dv;                         // from the pixel centre, px
  simd::Vector8 origin;                        // of the camera, world, m
  simd::Vector8 axis_x, axis_y, axis_z;        // of the camera, world
};

struct SamplePattern {
  std::vector<SamplePair> base;   // for every pixel
  std::vector<SamplePair> extra;  // as many again, for blocks with an edge
  float footprint = 1;            // of one sample, px
};

// `count` is 4, 8, 16 or 32: each sample has a row, a column and a moment of its own.
SamplePattern makeSamplePattern(int count, const ExposureMotion& motion);

}  // namespace diorama
