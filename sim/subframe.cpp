#include "sim/subframe.h"

#include <algorithm>
#include <cmath>

namespace diorama {
namespace {

// How far sub-frame k of `count` is shifted: shifts fill the pixel evenly (R2 sequence) and cancel
// in pairs, so that no edge moves.
Vector2d shiftOf(int k, int count) {
  const int pair = std::min(k, count - 1 - k);
  if (2 * k + 1 == count) return Vector2d::Zero();
  const auto fraction = [](double x) { return x - std::floor(x) - 0.5; };
  const Vector2d shift(fraction(0.7548776662 * (pair + 1)), fraction(0.5698402910 * (pair + 1)));
  return k == pair ? shift : -shift;
}

}  // namespace

Subframe subframeAt(const RenderScene& scene, const ExposureMotion& motion, double offset_s) {
  const SE3 T_world_camera = motion.T_world_camera(offset_s);
  Subframe result{{T_world_camera}};
  for (const MovingObject& object : scene.moving)
    result.T_layer_camera.push_back(motion.T_world_object(object.object, offset_s).inverse() *
                                    T_world_camera);
  return result;
}

Subframe subframeOf(const RenderScene& scene, const ExposureMotion& motion, int k, int count) {
  Subframe subframe = subframeAt(scene, motion, motion.exposure_s * ((k + 0.5) / count - 0.5));
  subframe.shift_px = shiftOf(k, count);
  subframe.weight = 1.f / static_cast<float>(count);
  return subframe;
}

std::vector<SE3> posesIn(const WideView& view, const Subframe& subframe) {
  const SE3 T_view_camera{Eigen::Quaterniond(view.R_view_camera), Vector3d::Zero()};
  std::vector<SE3> T_view_layer;
  for (const SE3& T_layer_camera : subframe.T_layer_camera)
    T_view_layer.push_back(T_view_camera * T_layer_camera.inverse());
  return T_view_layer;
}

}  // namespace diorama
