// A triangle as the rays (x, y, 1) of a camera see it: functions of x and y alone, whatever the
// lens.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "sim/direction_box.h"
#include "sim/simd.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace diorama {

constexpr float kBoxRounding = 2e-6f;  // of single precision in tests of boxes; some 1/1000 px

// A corner, and where its ray goes.
struct ImagedCorner {
  static constexpr double kNear_m = 1e-4;  // what is nearer counts as behind the camera
  Vector3d p;                              // camera frame
  float x = 0, y = 0;
  bool behind = false;

  explicit ImagedCorner(const Vector3d& position) : p(position), behind(p.z() < kNear_m) {
    const double inverse = 1 / p.z();
    x = static_cast<float>(p.x() * inverse);
    y = static_cast<float>(p.y() * inverse);
  }
};

// Everywhere when some are behind the camera, nowhere when all are.
template <class Corners>
DirectionBox boxAround(const Corners& corners) {
  DirectionBox box;
  size_t behind = 0;
  for (const ImagedCorner& c : corners) {
    behind += c.behind;
    box.extend(c.x, c.y);
  }
  if (behind == corners.size()) return {};
  if (behind > 0) return DirectionBox::everywhere();
  return {box.x0 - kBoxRounding, box.x1 + kBoxRounding, box.y0 - kBoxRounding,
          box.y1 + kBoxRounding};
}

// a x + b y + c
struct LinearForm {
  float a, b, c;
  LinearForm() = default;
  explicit LinearForm(const Vector3d& v)
      : a(static_cast<float>(v.x())), b(static_cast<float>(v.y())), c(static_cast<float>(v.z())) {}
  simd::Float8 operator()(simd::Float8 x, simd::Float8 y) const { return a * x + (b * y + c); }
  simd::Float8 most(simd::Float8 x, simd::Float8 y, simd::Float8 half_x,
                    simd::Float8 half_y) const {
    return (*this)(x, y) + (std::abs(a) * half_x + std::abs(b) * half_y);
  }
  float most(const DirectionBox& box) const {
    return std::max(a * box.x0, a * box.x1) + std::max(b * box.y0, b * box.y1) + c;
  }
};

// A triangle as the rays (x, y, 1) of the camera see it: a ray meets it where none of the weights,
// which are proportional to those of the corners, is negative. At a common edge the weights of two
// triangles differ in their sign only, to the last bit, so that no ray slips through.
struct PlacedTriangle {
  LinearForm weight0, weight1, weight2, inverse_depth;
  DirectionBox box;
  uint32_t triangle;
  float side;  // 1, or -1 where the corners turn the other way

  bool mayTouch(const DirectionBox& o) const {
    return weight0.most(o) >= 0 && weight1.most(o) >= 0 && weight2.most(o) >= 0;
  }
};

}  // namespace diorama

#pragma GCC diagnostic pop
