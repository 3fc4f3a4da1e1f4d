#include "sim/sequence_check_objects.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

namespace diorama {
namespace {

constexpr double kSame_m = 0.0003;  // depth files resolve 0.2 mm
constexpr double kDeepest_m = 65535 / 5000.0;
constexpr double kJitter_px = 0.01;  // outlines are decided by rounding
constexpr int kSteps = 5;            // of it, for depths on a rim that is seen edge-on

}  // namespace

// The object as a row of the image sees it.
struct ObjectComparison::View {
  const Camera& camera;
  const EmbreeRayQuery& rays;
  int object;
  SE3 T_camera_object, T_object_camera;

  std::optional<double> depthAt(double x, double y) const;
  // Whether the mesh agrees with a condition on its depth, here or a hundredth pixel away.
  template <class Condition>
  bool agrees(int x, int y, const Condition& condition) const;
  // How far a depth is off, m; 0 where it is right.
  double depthOff(int x, int y, double depth) const;
};

std::optional<double> ObjectComparison::View::depthAt(double x, double y) const {
  const auto direction = camera.unproject(Vector2d(x, y));
  if (!direction) return std::nullopt;
  const auto hit =
      rays.closestHit(object, T_object_camera.translation, T_object_camera.rotation * *direction);
  if (!hit) return std::nullopt;
  return (T_camera_object * hit->p_object).z();
}

template <class Condition>
bool ObjectComparison::View::agrees(int x, int y, const Condition& condition) const {
  if (condition(depthAt(x, y))) return true;
  for (const double dx : {-kJitter_px, kJitter_px})
    for (const double dy : {-kJitter_px, kJitter_px})
      if (condition(depthAt(x + dx, y + dy))) return true;
  return false;
}

double ObjectComparison::View::depthOff(int x, int y, double depth) const {
  const auto centre = depthAt(x, y);
  if (centre && std::abs(depth - *centre) < kSame_m) return 0;
  double nearest = std::numeric_limits<double>::infinity(), farthest = 0;
  for (int j = -kSteps; j <= kSteps; ++j)
    for (int i = -kSteps; i <= kSteps; ++i)
      if (const auto z = depthAt(x + i * kJitter_px, y + j * kJitter_px)) {
        nearest = std::min(nearest, *z);
        farthest = std::max(farthest, *z);
      }
  if (depth == 0 && farthest > kDeepest_m) return 0;
  if (depth > nearest - kSame_m && depth < farthest + kSame_m) return 0;
  return depth < nearest && farthest > 0 ? depth - nearest : depth - farthest;
}

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

// One ray for most pixels.
void ObjectComparison::comparePixel(const View& view, int x, int y, const ObjectImages& images,
                                    ObjectDifferences& result) const {
  const bool seen = images.seen(x, y);
  const bool whole = images.mask.empty() ? seen : images.mask(x, y) != 0;
  ++result.pixels;
  result.visible += seen;
  const auto isWhole = [&](const std::optional<double>& z) { return z.has_value() == whole; };
  if (!images.mask.empty() && !view.agrees(x, y, isWhole)) {
    if (result.mask++ == 0) result.mask_x = x, result.mask_y = y;
    return;
  }
  if (images.depth_m.empty() || !whole) return;
  const double depth = static_cast<double>(images.depth_m(x, y));
  if (seen) {
    const double off = view.depthOff(x, y, depth);
    if (off != 0 && result.depth++ == 0)
      result.depth_x = x, result.depth_y = y, result.depth_off_m = off;
    return;
  }
  const auto standsBefore = [&](const std::optional<double>& z) {
    return !z || depth < *z + kSame_m;
  };
  if (depth > 0 && !view.agrees(x, y, standsBefore) && result.hidden++ == 0)
    result.hidden_x = x, result.hidden_y = y;
}

ObjectDifferences ObjectComparison::compare(int object,
                                            const std::function<SE3(int)>& T_camera_object,
                                            const ObjectImages& images) const {
  ObjectDifferences result;
  Box box = imageBox(object, T_camera_object(camera_.height() / 2));
  for (int y = 0; y < camera_.height(); ++y)
    for (int x = 0; x < camera_.width(); ++x)
      if (images.seen(x, y) || (!images.mask.empty() && images.mask(x, y)))
        box = {std::min(box.x0, x), std::min(box.y0, y), std::max(box.x1, x), std::max(box.y1, y)};
  for (int y = box.y0; y <= box.y1; ++y) {
    const SE3 pose = T_camera_object(y);
    const View view{camera_, rays_, object, pose, pose.inverse()};
    for (int x = box.x0; x <= box.x1; ++x) comparePixel(view, x, y, images, result);
  }
  return result;
}

}  // namespace diorama
