// Boxes around the parts of an object, to find out quickly where it may keep a light away.
#pragma once

#include <Eigen/Geometry>
#include <array>

#include "sim/render_scene.h"
#include "sim/simd.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"

namespace diorama {

class LightBlockers {
 public:
  explicit LightBlockers(const RenderScene& object);

  // Whether something of the object may stand between a light and some point of a sphere. All in
  // the object's frame.
  bool mayHide(const RectangleLight& light, const Vector3f& center, float radius_m) const;

 private:
  static constexpr int kDepth = 4;  // halvings: 16 parts, eight to a vector
  struct Boxes {
    std::array<simd::Float8, 3> min, max;  // by axis
    bool meetCone(const Vector3f& p, float radius_m, const Vector3f& way, float half) const;
  };
  std::array<Boxes, (1 << kDepth) / 8> parts_;
  Boxes whole_;  // the same box in all lanes
};

}  // namespace diorama

#pragma GCC diagnostic pop
