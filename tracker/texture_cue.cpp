#include "tracker/texture_cue.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "tracker/corners.h"

namespace diorama {
namespace {

constexpr int kBorder = 9;            // px from the image's outline to a patch centre
constexpr double kFlatDepth = 0.004;  // of the distance: deviation from a plane
constexpr double kRayleigh = 0.57;    // 0.85 / 1.4826: median distance in the plane to sigma

Patch::Window windowAround(const Image<uint8_t>& image, const Vector2d& u) {
  constexpr int kReach = Patch::kWindowSide / 2;
  Patch::Window window;
  float* value = window.data();
  for (int y = -kReach; y <= kReach; ++y) {
    const uint8_t* row = image.row(static_cast<int>(u.y()) + y) + static_cast<int>(u.x());
    for (int x = -kReach; x <= kReach; ++x) *value++ = row[x];
  }
  return window;
}

}  // namespace

TextureCue::TextureCue(const EdgeModel& model, const Camera& camera, const RayQuery& rays,
                       int object, const TrackerOptions& options, double correlation)
    : model_(model),
      camera_(camera),
      rays_(rays),
      object_(object),
      options_(options),
      correlation_(correlation) {}

void TextureCue::setKeyframe(const Image<uint8_t>& image, const SE3& T, const Matrix6d& covariance,
                             const CoverMap& cover, const Print& print) {
  patches_.clear();
  T_keyframe_ = T;
  keyframe_covariance_ = covariance;
  if (options_.texture_patches == 0) return;
  const ProjectedBox box = projectedBox(model_, camera_, T);
  for (const Vector2d& corner : findCorners(image, box.low, box.high, kBorder)) {
    if (patches_.size() >= static_cast<size_t>(options_.texture_patches)) break;
    // A patch on the rim of a cover would move with it.
    if (!cover.touches(corner, 2 * Patch::kRadius)) addPatch(image, T, corner, print);
  }
}

void TextureCue::setPatches(std::vector<Patch> patches, const SE3& T) {
  patches_ = std::move(patches);
  T_keyframe_ = T;
  keyframe_covariance_.setZero();
}

void TextureCue::addPatch(const Image<uint8_t>& image, const SE3& T, const Vector2d& u,
                          const Print& print) {
  const Matrix3d R_model_camera = T.rotationMatrix().transpose();
  const Vector3d eye = T.inverse().translation;
  const auto hit = [&](double dx, double dy) -> std::optional<RayHit> {
    const auto direction = camera_.unproject(u + Vector2d(dx, dy));
    if (!direction) return std::nullopt;
    auto h = rays_.closestHit(object_, eye + model_.centre_object, R_model_camera * *direction);
    if (h) h->p_object -= model_.centre_object;
    return h;
  };
  const auto centre = hit(0, 0);
  Patch patch;
  if (!centre || print.isKnown(centre->triangle) ||
      !patch.setPlane(centre->p_object, centre->normal, camera_, T))
    return;
  constexpr double reach = Patch::kRadius + 1;
  for (const double sx : {-reach, reach})
    for (const double sy : {-reach, reach}) {
      const auto corner = hit(sx, sy);
      if (!corner || std::abs(centre->normal.dot(corner->p_object - centre->p_object)) >
                         kFlatDepth * T.translation.z())
        return;
    }
  if (patch.setValues(windowAround(image, u))) patches_.push_back(patch);
}

bool TextureCue::keyframeNeeded(const SE3& T) const {
  if (patches_.empty() || viewChanged(T, options_.keyframe_view_cosine, options_.keyframe_scale))
    return true;
  const Agreement now = agreement(2);
  return now.agreeing < options_.keyframe_agreement * static_cast<double>(now.expected);
}

bool TextureCue::viewChanged(const SE3& T, double view_cosine, double most_scale) const {
  const Vector3d view = T.inverse().translation.normalized();
  const Vector3d keyframe_view = T_keyframe_.inverse().translation.normalized();
  const double scale = T.translation.z() / T_keyframe_.translation.z();
  return !(view.dot(keyframe_view) >= view_cosine && scale < most_scale && scale > 1 / most_scale);
}

void TextureCue::align(const Image<uint8_t>& image, const SE3& T, const CoverMap& cover) {
  for (Patch& patch : patches_) {
    const auto u = camera_.project(T * patch.p);
    patch.expected = patch.found = false;
    if (u && !cover.isCovered(*u)) patch.align(image, camera_, T, options_.patch_correlation);
  }
}

CueEquations TextureCue::linearise(const SE3& T) {
  const Matrix3d R = T.rotationMatrix();
  CueEquations equations;
  std::vector<std::pair<Matrix26d, Vector2d>> terms(patches_.size());
  absolute_.clear();
  for (size_t i = 0; i < patches_.size(); ++i) {
    Patch& patch = patches_[i];
    if (!patch.found) continue;
    const auto projection = camera_.projectWithJacobian(R * patch.p + T.translation);
    if (!projection) {
      patch.found = false;
      continue;
    }
    terms[i] = {pointJacobian(projection->J, R, patch.p), projection->u_px - patch.u_px};
    patch.distance_px = terms[i].second.norm();
    absolute_.push_back(patch.distance_px);
  }
  // A pose can be fitted to three patches wherever they lie: that they agree tells nothing. A scale
  // of few residuals is uncertain itself: errors have Student's distribution.
  const int residuals = 2 * static_cast<int>(absolute_.size()), freedom = residuals - 6;
  if (freedom <= 2) return given_keyframe_ = equations;
  equations.residuals = residuals;
  const double fitted = std::sqrt(residuals / static_cast<double>(freedom));
  const double scale =
      std::max(kRayleigh * robustScale(absolute_) * fitted, options_.texture_sigma_px);
  equations.sigma_px = scale * std::sqrt(freedom / (freedom - 2.0));
  for (size_t i = 0; i < patches_.size(); ++i) {
    if (!patches_[i].found) continue;
    const double weight =
        tukeyWeight(patches_[i].distance_px / equations.sigma_px, options_.tukey_constant) /
        (equations.sigma_px * equations.sigma_px * correlation_);
    if (!(weight > 0)) continue;
    const auto& [J, r] = terms[i];
    for (int k = 0; k < 2; ++k) equations.add(J.row(k).transpose(), r[k], weight);
  }
  given_keyframe_ = equations;
  // The patches see the pose T exp(x) exp(e) with the keyframe's error e ~ N(0, P). Minimised over
  // e, (x + e)' H (x + e) / 2 + g' (x + e) + e' P^-1 e / 2 has Hessian (I + H P)^-1 H and gradient
  // (I + H P)^-1 g.
  const Eigen::PartialPivLU<Matrix6d> discount(
      Matrix6d(Matrix6d::Identity() + equations.hessian * keyframe_covariance_));
  const Matrix6d hessian = discount.solve(equations.hessian);
  equations.hessian = 0.5 * (hessian + hessian.transpose());
  equations.gradient = discount.solve(equations.gradient).eval();
  return equations;
}

// The same cost with the other cue's x' Ho x / 2 + go' x, minimised over x instead.
void TextureCue::correctKeyframe(const CueEquations& given_keyframe, const CueEquations& other) {
  // The other cue errs alike in neighbouring frames.
  const Matrix6d Ho = other.hessian / options_.keyframe_correlation;
  const Vector6d go = other.gradient / options_.keyframe_correlation;
  const Matrix6d& H = given_keyframe.hessian;
  const Vector6d& g = given_keyframe.gradient;
  Matrix6d both = Ho + H;
  both.diagonal() *= 1 + options_.damping;
  const Eigen::LDLT<Matrix6d> solver(both);
  const Matrix6d seen = H - H * solver.solve(H);
  const Vector6d slope = g - H * solver.solve(go + g);
  // (P^-1 + seen)^-1 without the inverse of P, which may be singular.
  const Eigen::PartialPivLU<Matrix6d> update(
      Matrix6d(Matrix6d::Identity() + keyframe_covariance_ * seen));
  const Matrix6d covariance = update.solve(keyframe_covariance_);
  const Vector6d error = -update.solve(keyframe_covariance_ * slope);
  if (!covariance.allFinite() || !error.allFinite()) return;
  keyframe_covariance_ = 0.5 * (covariance + covariance.transpose());
  const SE3 correction = exp(error);
  for (Patch& patch : patches_) {
    patch.p = correction * patch.p;
    patch.along_x = correction.rotation * patch.along_x;
    patch.along_y = correction.rotation * patch.along_y;
  }
}

TextureCue::Agreement TextureCue::agreement(double max_distance_px) const {
  Agreement out;
  for (const Patch& patch : patches_) {
    out.expected += patch.expected;
    out.agreeing += patch.found && patch.distance_px < max_distance_px;
  }
  return out;
}

}  // namespace diorama
