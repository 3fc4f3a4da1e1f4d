#include "tracker/texture_cue.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "tracker/corners.h"

namespace diorama {
namespace {

constexpr int kBorder = 9;               // px from the image's outline to a patch centre
constexpr double kFlatDepth = 0.004;     // of the distance: deviation from a plane
constexpr double kSteepest = 0.2;        // cosine between the surface's normal and the ray
constexpr double kWeakestHessian = 500;  // smaller eigenvalue: a patch that would slide
constexpr int kAlignIterations = 6;
constexpr double kFarthest = 6;        // px a patch may lie from where the pose says
constexpr double kSmallestArea = 0.2;  // of a patch pixel's area now against the keyframe
constexpr double kRayleigh = 0.57;     // 0.85 / 1.4826: median distance in the plane to sigma

}  // namespace

TextureCue::TextureCue(const EdgeModel& model, const Camera& camera, const RayQuery& rays,
                       int object, const TrackerOptions& options)
    : model_(model), camera_(camera), rays_(rays), object_(object), options_(options) {}

void TextureCue::setKeyframe(const Image<uint8_t>& image, const SE3& T, const Matrix6d& covariance,
                             const CoverMap& cover) {
  patches_.clear();
  T_keyframe_ = T;
  keyframe_covariance_ = covariance;
  if (options_.texture_patches == 0) return;
  const ProjectedBox box = projectedBox(model_, camera_, T);
  for (const Vector2d& corner : findCorners(image, box.low, box.high, kBorder)) {
    if (patches_.size() >= static_cast<size_t>(options_.texture_patches)) break;
    if (!touchesCover(cover, corner)) addPatch(image, T, corner);
  }
}

// A patch on the rim of a cover would move with it.
bool TextureCue::touchesCover(const CoverMap& cover, const Vector2d& u) {
  constexpr double reach = 2 * kRadius;
  for (const double x : {-reach, 0.0, reach})
    for (const double y : {-reach, 0.0, reach})
      if (cover.isCovered(u + Vector2d(x, y))) return true;
  return false;
}

void TextureCue::addPatch(const Image<uint8_t>& image, const SE3& T, const Vector2d& u) {
  const Matrix3d R_model_camera = T.rotationMatrix().transpose();
  const Vector3d eye = T.inverse().translation;
  const auto ray = [&](double dx, double dy) -> std::optional<Vector3d> {
    const auto d = camera_.unproject(u + Vector2d(dx, dy));
    if (!d) return std::nullopt;
    return R_model_camera * *d;
  };
  const auto hit = [&](const std::optional<Vector3d>& direction) -> std::optional<RayHit> {
    if (!direction) return std::nullopt;
    auto h = rays_.closestHit(object_, eye + model_.centre_object, *direction);
    if (h) h->p_object -= model_.centre_object;
    return h;
  };
  const auto middle = ray(0, 0);
  const auto centre = hit(middle);
  if (!centre) return;
  const Vector3d &p = centre->p_object, &n = centre->normal;
  if (std::abs(n.dot(*middle)) < kSteepest * middle->norm()) return;
  constexpr double reach = kRadius + 1;
  for (const double sx : {-reach, reach})
    for (const double sy : {-reach, reach}) {
      const auto corner = hit(ray(sx, sy));
      if (!corner || std::abs(n.dot(corner->p_object - p)) > kFlatDepth * T.translation.z()) return;
    }
  const auto right = ray(1, 0), down = ray(0, 1);
  if (!right || !down) return;
  const double height = n.dot(p - eye);
  Patch patch;
  patch.p = p;
  patch.along_x = eye + *right * (height / n.dot(*right)) - p;
  patch.along_y = eye + *down * (height / n.dot(*down)) - p;
  if (!patch.along_x.allFinite() || !patch.along_y.allFinite()) return;
  if (fillValues(image, static_cast<int>(u.x()), static_cast<int>(u.y()), patch))
    patches_.push_back(patch);
}

bool TextureCue::fillValues(const Image<uint8_t>& image, int x, int y, Patch& patch) const {
  int k = 0;
  for (Values* values : {&patch.grey, &patch.gradient_x, &patch.gradient_y}) values->setZero();
  float mean = 0, mean_x = 0, mean_y = 0;
  for (int j = -kRadius; j <= kRadius; ++j)
    for (int i = -kRadius; i <= kRadius; ++i, ++k) {
      patch.grey[k] = image(x + i, y + j);
      patch.gradient_x[k] =
          0.5f * static_cast<float>(image(x + i + 1, y + j) - image(x + i - 1, y + j));
      patch.gradient_y[k] =
          0.5f * static_cast<float>(image(x + i, y + j + 1) - image(x + i, y + j - 1));
      mean += patch.grey[k];
      mean_x += patch.gradient_x[k];
      mean_y += patch.gradient_y[k];
    }
  float norm2 = 0, xx = 0, xy = 0, yy = 0;
  for (k = 0; k < static_cast<int>(kPixels); ++k) {
    patch.grey[k] -= mean / kPixels;
    float& gx = patch.gradient_x[k];
    float& gy = patch.gradient_y[k];
    gx -= mean_x / kPixels;
    gy -= mean_y / kPixels;
    norm2 += patch.grey[k] * patch.grey[k];
    xx += gx * gx;
    xy += gx * gy;
    yy += gy * gy;
  }
  Matrix2d H;
  H << xx, xy, xy, yy;
  const double half_trace = H.trace() / 2;
  const double weakest =
      half_trace - std::sqrt(std::max(0.0, half_trace * half_trace - H.determinant()));
  if (weakest < kWeakestHessian) return false;
  patch.inverse_hessian = H.inverse();
  patch.norm = std::sqrt(norm2);
  return true;
}

bool TextureCue::keyframeNeeded(const SE3& T) const {
  const Vector3d view = T.inverse().translation.normalized();
  const Vector3d keyframe_view = T_keyframe_.inverse().translation.normalized();
  const double scale = T.translation.z() / T_keyframe_.translation.z();
  if (view.dot(keyframe_view) < options_.keyframe_view_cosine) return true;
  if (!(scale < options_.keyframe_scale && scale > 1 / options_.keyframe_scale)) return true;
  const Agreement now = agreement(2);
  return now.agreeing < options_.keyframe_agreement * static_cast<double>(now.expected);
}

void TextureCue::align(const Image<uint8_t>& image, const SE3& T, const CoverMap& cover) {
  for (Patch& patch : patches_) alignPatch(image, T, cover, patch);
}

// Grey values around u, where a and b are the steps to the next one. Pixels are read one after the
// other, so that the rest calculates with many at once.
void TextureCue::readPatch(const Image<uint8_t>& image, const Vector2d& u, const Vector2d& a,
                           const Vector2d& b, Values& out) {
  static const std::array<Values, 2> places = [] {
    std::array<Values, 2> xy;
    for (size_t k = 0; k < kWhole; ++k) {
      constexpr int kSide = 2 * kRadius + 1;
      const int i = static_cast<int>(std::min(k, kPixels - 1)), at = static_cast<int>(k);
      xy[0][at] = static_cast<float>(i % kSide - kRadius);
      xy[1][at] = static_cast<float>(i / kSide - kRadius);
    }
    return xy;
  }();
  const Eigen::Vector2f start = u.cast<float>(), x_step = a.cast<float>(), y_step = b.cast<float>();
  float dx[kWhole], dy[kWhole];
  int pixel[kWhole];
  for (size_t k = 0; k < kWhole; ++k) {
    const float i = places[0].data()[k], j = places[1].data()[k];
    const float x = start.x() + i * x_step.x() + j * y_step.x();
    const float y = start.y() + i * x_step.y() + j * y_step.y();
    const int xi = static_cast<int>(x), yi = static_cast<int>(y);
    pixel[k] = yi * image.width + xi;
    dx[k] = x - static_cast<float>(xi);
    dy[k] = y - static_cast<float>(yi);
  }
  int corners[4][kWhole];
  const uint8_t *const row = image.row(0), *const below = image.row(1);
  for (size_t k = 0; k < kWhole; ++k) {
    corners[0][k] = row[pixel[k]];
    corners[1][k] = row[pixel[k] + 1];
    corners[2][k] = below[pixel[k]];
    corners[3][k] = below[pixel[k] + 1];
  }
  for (size_t k = 0; k < kWhole; ++k) {
    const auto grey = [&](int corner) { return static_cast<float>(corners[corner][k]); };
    const float top = grey(0) + dx[k] * (grey(1) - grey(0));
    const float bottom = grey(2) + dx[k] * (grey(3) - grey(2));
    out.data()[k] = top + dy[k] * (bottom - top);
  }
  out.tail<kWhole - kPixels>().setZero();
}

// Inverse compositional search of a translation; the pose gives the affine part of the warp, mean
// and contrast are normalised.
void TextureCue::alignPatch(const Image<uint8_t>& image, const SE3& T, const CoverMap& cover,
                            Patch& patch) const {
  patch.expected = patch.found = false;
  const Matrix3d R = T.rotationMatrix();
  const auto projection = camera_.projectWithJacobian(R * patch.p + T.translation);
  if (!projection || cover.isCovered(projection->u_px)) return;
  const Matrix23d J = projection->J * R;
  const Vector2d a = J * patch.along_x, b = J * patch.along_y;
  if (a.x() * b.y() - a.y() * b.x() < kSmallestArea) return;
  const double reach_x = kRadius * (std::abs(a.x()) + std::abs(b.x())) + 1;
  const double reach_y = kRadius * (std::abs(a.y()) + std::abs(b.y())) + 1;
  const Vector2d expected = projection->u_px;
  const auto inside = [&](const Vector2d& u) {
    return u.x() >= reach_x && u.y() >= reach_y && u.x() < image.width - 1 - reach_x &&
           u.y() < image.height - 1 - reach_y;
  };
  patch.expected = inside(expected);
  Vector2d u = expected;
  double correlation = 0;
  Values now;
  for (int iteration = 0; iteration < kAlignIterations; ++iteration) {
    if (!inside(u) || (u - expected).norm() > kFarthest) return;
    readPatch(image, u, a, b, now);
    now.head<kPixels>() -= now.sum() / kPixels;
    const float norm = std::sqrt(now.square().sum()) + 1e-6f;
    correlation = static_cast<double>((now * patch.grey).sum() / (norm * patch.norm));
    const float gain = std::clamp(patch.norm / norm, 0.5f, 2.0f);
    const Values error = gain * now - patch.grey;
    const Vector2d step =
        patch.inverse_hessian * Vector2d(static_cast<double>((patch.gradient_x * error).sum()),
                                         static_cast<double>((patch.gradient_y * error).sum()));
    u -= a * step.x() + b * step.y();
    if (step.norm() < 0.02) break;
  }
  patch.found = correlation > options_.patch_correlation && u.allFinite();
  patch.u_px = u;
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
  equations.residuals = 2 * static_cast<int>(absolute_.size());
  equations.sigma_px = std::max(kRayleigh * robustScale(absolute_), options_.texture_sigma_px);
  for (size_t i = 0; i < patches_.size(); ++i) {
    if (!patches_[i].found) continue;
    const double weight =
        tukeyWeight(patches_[i].distance_px / equations.sigma_px, options_.tukey_constant) /
        (equations.sigma_px * equations.sigma_px * options_.texture_correlation);
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
void TextureCue::correctKeyframe(const CueEquations& other) {
  // The other cue errs alike in neighbouring frames.
  const Matrix6d Ho = other.hessian / options_.keyframe_correlation;
  const Vector6d go = other.gradient / options_.keyframe_correlation;
  const Matrix6d& H = given_keyframe_.hessian;
  const Vector6d& g = given_keyframe_.gradient;
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
