#include "vo/exposure.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "vo/reprojection.h"

namespace diorama::vo {
namespace {

// Shutters are open for up to a half of the time between frames; a quarter of the motion is usual.
constexpr double kSharpMotionPx = 8;
constexpr double kFastPx = 16;  // from frame to frame: a step of the share is a pixel
constexpr size_t kFeaturesPerFrame = 20;
constexpr int kFeaturesPerStep = 120;

Vector2d motionOf(const Camera& camera, const TrackedFrame& frame, const Vector3d& p_camera) {
  const auto now = camera.project(p_camera), before = camera.project(frame.T_before_now * p_camera);
  return now && before ? Vector2d(*now - *before) : Vector2d::Zero();
}

std::vector<const Feature*> fastFeatures(const Camera& camera, const TrackedFrame& frame) {
  const SE3 T_camera_world = frame.T_world_camera.inverse();
  std::vector<const Feature*> fast;
  for (const Feature& feature : frame.features) {
    if (fast.size() == kFeaturesPerFrame) break;
    if (motionOf(camera, frame, T_camera_world * feature.point->p_world).norm() >= kFastPx)
      fast.push_back(&feature);
  }
  return fast;
}

}  // namespace

Vector2d smearOf(const Camera& camera, const TrackedFrame& frame, const Vector3d& p_camera) {
  return frame.exposure_share * motionOf(camera, frame, p_camera);
}

// Widths of blurs add up as squares.
Vector2d smearOf(const Camera& camera, const TrackedFrame& frame, const TrackedFrame& reference,
                 const Vector3d& p_world) {
  const Vector2d smear = smearOf(camera, frame, frame.T_world_camera.inverse() * p_world);
  const double had =
      smearOf(camera, reference, reference.T_world_camera.inverse() * p_world).squaredNorm();
  const double has = smear.squaredNorm();
  return has > had ? Vector2d(std::sqrt(1 - had / has) * smear) : Vector2d::Zero();
}

int blurredLevels(const Camera& camera, const TrackedFrame& last, const TrackedFrame& now) {
  const double focal = 0.5 * (camera.fx() + camera.fy());
  const SE3 T = last.T_world_camera.inverse() * now.T_world_camera;
  const double median = depthRange(last).median_m;
  const double px = focal * (Eigen::AngleAxisd(T.rotation).angle() + T.translation.norm() / median);
  int levels = 0;
  for (double motion = px; motion > kSharpMotionPx && levels < 4; motion /= 2) ++levels;
  return levels;
}

void ExposureLearning::learn(const Camera& camera, const TrackedFrame& frame) {
  if (!options_.blur_patches) return;
  const std::vector<const Feature*> fast = fastFeatures(camera, frame);
  if (fast.empty()) return;
  TrackedFrame shorter = frame, same = frame, longer = frame;
  shorter.exposure_share = std::max(0.0, share_ - kStep);
  same.exposure_share = share_;
  longer.exposure_share = std::min(1.0, share_ + kStep);
  for (const Feature* feature : fast) {
    const auto a = patchDifference(camera, shorter, *feature, options_);
    const auto b = patchDifference(camera, same, *feature, options_);
    const auto c = patchDifference(camera, longer, *feature, options_);
    if (!a || !b || !c) continue;
    shorter_ += *a, same_ += *b, longer_ += *c;
    ++count_;
  }
  if (count_ < kFeaturesPerStep) return;
  if (shorter_ < std::min(same_, longer_)) share_ = shorter.exposure_share;
  if (longer_ < std::min(same_, shorter_)) share_ = longer.exposure_share;
  shorter_ = same_ = longer_ = 0;
  count_ = 0;
}

}  // namespace diorama::vo
