#include "sim/sequence_check_objects.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace diorama {
namespace {

constexpr double kSame_m = 0.0003;  // depth files resolve 0.2 mm
constexpr double kDeepest_m = 65535 / 5000.0;
constexpr double kJitter_px = 0.01;  // outlines are decided by rounding
constexpr int kSteps = 5;            // of it, for depths on a rim that is seen edge-on

}  // namespace

struct ObjectComparison::View {
  int object;
  SE3 T_camera_object, T_object_camera;
};

ObjectComparison::ObjectComparison(const Camera& camera, const std::vector<Mesh>& meshes)
    : camera_(camera), rays_(meshes) {
  for (const Mesh& mesh : meshes)
    corners_.emplace_back(mesh.minCorner().cast<double>(), mesh.maxCorner().cast<double>());
}

// Where the object can be: around its box's corners; the whole image when one is behind the camera.
ObjectComparison::Box ObjectComparison::imageBox(int object, const SE3& T_camera_object) const {
  constexpr int kMargin_px = 16;  // lenses bend the edges of the box
  const Box all{0, 0, camera_.width() - 1, camera_.height() - 1};
  const auto& [least, most] = corners_[static_cast<size_t>(object)];
  Vector2d lower = Vector2d::Constant(1e9), upper = -lower;
  for (int k = 0; k < 8; ++k) {
    const Vector3d corner((k & 1 ? most : least).x(), (k & 2 ? most : least).y(),
                          (k & 4 ? most : least).z());
    const auto u = camera_.project(T_camera_object * corner);
    if (!u) return all;
    lower = lower.cwiseMin(*u);
    upper = upper.cwiseMax(*u);
  }
  const auto clamped = [&](double v, int margin, int size) {
    return static_cast<int>(std::clamp(std::round(v) + margin, -1.0, static_cast<double>(size)));
  };
  return {std::max(0, clamped(lower.x(), -kMargin_px, all.x1)),
          std::max(0, clamped(lower.y(), -kMargin_px, all.y1)),
          std::min(all.x1, clamped(upper.x(), kMargin_px, all.x1)),
          std::min(all.y1, clamped(upper.y(), kMargin_px, all.y1))};
}

std::optional<double> ObjectComparison::depthAt(const View& view, const Vector2d& u_px) const {
  const auto direction = camera_.unproject(u_px);
  if (!direction) return std::nullopt;
  const auto hit = rays_.closestHit(view.object, view.T_object_camera.translation,
                                    view.T_object_camera.rotation * *direction);
  if (!hit) return std::nullopt;
  return (view.T_camera_object * hit->p_object).z();
}

ObjectDifferences ObjectComparison::compare(int object,
                                            const std::function<SE3(int)>& T_camera_object,
                                            const ObjectImages& images) const {
  ObjectDifferences result;
  Box box = imageBox(object, T_camera_object(camera_.height() / 2));
  const auto extend = [&](int x, int y) {
    box = {std::min(box.x0, x), std::min(box.y0, y), std::max(box.x1, x), std::max(box.y1, y)};
  };
  for (int y = 0; y < camera_.height(); ++y)
    for (int x = 0; x < camera_.width(); ++x)
      if (images.seen(x, y) || (!images.mask.empty() && images.mask(x, y))) extend(x, y);

  for (int y = box.y0; y <= box.y1; ++y) {
    const SE3 pose = T_camera_object(y);
    const View view{object, pose, pose.inverse()};
    for (int x = box.x0; x <= box.x1; ++x) {
      // Whether the mesh agrees with a condition on its depth, here or a hundredth pixel away.
      const auto agrees = [&](const auto& condition) {
        if (condition(depthAt(view, Vector2d(x, y)))) return true;
        for (int k = 0; k < 4; ++k)
          if (condition(depthAt(view, Vector2d(x + (k & 1 ? kJitter_px : -kJitter_px),
                                               y + (k & 2 ? kJitter_px : -kJitter_px)))))
            return true;
        return false;
      };
      const auto isBetween = [&](double depth) {
        double nearest = std::numeric_limits<double>::infinity(), farthest = -nearest;
        for (int j = -kSteps; j <= kSteps; ++j)
          for (int i = -kSteps; i <= kSteps; ++i)
            if (const auto z = depthAt(view, Vector2d(x + i * kJitter_px, y + j * kJitter_px))) {
              nearest = std::min(nearest, *z);
              farthest = std::max(farthest, *z);
            }
        return depth > nearest - kSame_m && depth < farthest + kSame_m;
      };
      const bool seen = images.seen(x, y);
      const bool whole = images.mask.empty() ? seen : images.mask(x, y) != 0;
      ++result.pixels;
      result.visible += seen;
      if (!images.mask.empty() &&
          !agrees([&](const std::optional<double>& z) { return z.has_value() == whole; })) {
        if (result.mask++ == 0) result.mask_x = x, result.mask_y = y;
        continue;
      }
      if (images.depth_m.empty() || !whole) continue;
      const double depth = static_cast<double>(images.depth_m(x, y));
      if (seen && !agrees([&](const std::optional<double>& z) {
            return z && (std::abs(depth - *z) < kSame_m || (depth == 0 && *z > kDeepest_m));
          }) &&
          !isBetween(depth)) {
        if (result.depth++ == 0) {
          result.depth_x = x, result.depth_y = y;
          result.depth_off_m = depth - depthAt(view, Vector2d(x, y)).value_or(depth);
        }
      }
      if (!seen && depth > 0 &&
          !agrees([&](const std::optional<double>& z) { return !z || depth < *z + kSame_m; })) {
        if (result.hidden++ == 0) result.hidden_x = x, result.hidden_y = y;
      }
    }
  }
  return result;
}

}  // namespace diorama
