// The places at which light is baked: a triangular grid on each triangle, with samples that
// coincide in position and normal merged into one point, so that no seam shows between triangles.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "sim/render_scene.h"

namespace diorama {

struct LightGrid {
  std::vector<int> resolution;            // per triangle, intervals along an edge
  std::vector<int> offset;                // per triangle, its first sample
  std::vector<uint32_t> point_of_sample;  // samples in the order of LightMap
  std::vector<Vector3f> positions;  // m, world; edge points lie a little inside their triangle
  std::vector<Vector3f> normals;    // unit

  size_t pointCount() const { return positions.size(); }
  uint32_t point(size_t triangle, int i, int j) const {
    const int r = resolution[triangle];
    return point_of_sample[static_cast<size_t>(offset[triangle] + j * (r + 1) - j * (j - 1) / 2 +
                                               i)];
  }
  // The points around a place on a triangle, for linear interpolation.
  struct Cell {
    std::array<uint32_t, 3> point;
    std::array<float, 3> weight;
  };
  Cell cellAt(size_t triangle, float u, float v) const;
  Vector3f at(size_t triangle, float u, float v, const std::vector<Vector3f>& values) const;
};

// Samples are about spacing + growth * distance apart, the distance taken to the box around the
// scene's objects; wider when there would be more than max_samples.
struct LightSpacing {
  double spacing_m = 0.004;
  double growth = 0;
  int max_samples = 0;
};

// Gives each triangle its place in the light map; returns the number of samples.
size_t layOutLight(RenderScene& scene, const LightSpacing& spacing);

// The points of the samples where `divisor` intervals of the light map make one of the grid.
LightGrid makeLightGrid(const RenderScene& scene, int divisor = 1);

// The means of each point and its neighbours in the grids.
std::vector<Vector3f> smoothed(const LightGrid& grid, const std::vector<Vector3f>& values);

// Gives points that are marked bad the mean of their good neighbours, spreading three steps far.
void refill(const LightGrid& grid, std::vector<uint8_t> bad, std::vector<Vector3f>& values);

}  // namespace diorama
