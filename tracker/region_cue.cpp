#include "tracker/region_cue.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace diorama {
namespace {

constexpr float kMislabelled = 0.14f;   // share of the pixels whose colour tells the wrong side
constexpr double kSmallestScale = 0.7;  // of residuals over their standard deviations
constexpr float kSeldom = 1e-3f;        // of a colour that is hardly the object's
constexpr float kOneIn = 1e-4f;         // of a colour that was never seen
constexpr double kPixelVariance = 1.0 / 12;

double rgbVariance(double width) { return width * width / 12; }

}  // namespace

int OutlineColors::colorAt(const EdgePicture& picture, const Vector2d& u_px) {
  const int x = static_cast<int>(u_px.x() + 0.5), y = static_cast<int>(u_px.y() + 0.5);
  constexpr int kShift = 4;
  static_assert(256 >> kShift == kLevels);
  if (!picture.rgb) {
    const int level = (*picture.grey)(x, y) >> kShift;
    return (level * kLevels + level) * kLevels + level;
  }
  const Rgb8& c = (*picture.rgb)(x, y);
  return ((c.r >> kShift) * kLevels + (c.g >> kShift)) * kLevels + (c.b >> kShift);
}

void OutlineColors::learn(const EdgePicture& picture, const std::vector<SampleSides>& outline,
                          float inside_rate, float beside_rate) {
  std::vector<float> inside(kColors), beside(kColors);
  float inner = 0, outer = 0;
  for (const SampleSides& s : outline) {
    for (int k = 1; k <= s.inner_px; ++k, ++inner)
      ++inside[static_cast<size_t>(colorAt(picture, s.u_px - k * s.outwards))];
    for (int k = 1; k <= s.outer_px; ++k, ++outer)
      ++beside[static_cast<size_t>(colorAt(picture, s.u_px + k * s.outwards))];
  }
  constexpr float kFewest = 100;
  if (inner < kFewest || outer < kFewest) return;
  if (!known_) {
    inside_.assign(kColors, 0);
    beside_.assign(kColors, 0);
    ratio_.assign(kColors, 0);
    inside_rate = beside_rate = 1;
  }
  known_ = true;
  for (size_t i = 0; i < kColors; ++i) {
    inside_[i] += inside_rate * (inside[i] / inner - inside_[i]);
    beside_[i] += beside_rate * (beside[i] / outer - beside_[i]);
    const float a = inside_[i] + kOneIn, b = beside_[i] + kOneIn;
    ratio_[i] = std::log(((1 - kMislabelled) * a + kMislabelled * b) /
                         (kMislabelled * a + (1 - kMislabelled) * b));
  }
}

bool OutlineColors::isFamiliar(const EdgePicture& picture, const SampleSides& s) const {
  const auto isKnown = [&](const Vector2d& direction, int reach) {
    int familiar = 0;
    for (int k = 1; k <= reach; ++k)
      familiar += inside_[static_cast<size_t>(colorAt(picture, s.u_px + k * direction))] > kSeldom;
    return 2 * familiar >= reach;
  };
  return isKnown(-s.outwards, s.inner_px) && (s.outline || isKnown(s.outwards, s.outer_px));
}

int OutlineColors::likelihoods(const EdgePicture& picture, const SampleSides& s,
                               std::array<float, kPlaces>& log_likelihood) const {
  float sum = 0;
  int count = 0;
  log_likelihood[0] = 0;
  for (int k = -s.inner_px; k <= s.outer_px; ++k) {
    sum += ratio_[static_cast<size_t>(colorAt(picture, s.u_px + k * s.outwards))];
    log_likelihood[static_cast<size_t>(++count)] = sum;
    if (count + 1 == kPlaces + 1) break;
  }
  return count + 1;
}

OutlinePlace OutlineColors::place(const EdgePicture& picture, const SampleSides& s) const {
  std::array<float, kPlaces> log_likelihood;
  const int count = likelihoods(picture, s, log_likelihood);
  const float best = *std::max_element(log_likelihood.begin(), log_likelihood.begin() + count);
  double weights = 0, mean = 0, square = 0;
  for (int i = 0; i < count; ++i) {
    const double weight = std::exp(log_likelihood[static_cast<size_t>(i)] - best);
    const double at = i - s.inner_px - 0.5;
    weights += weight;
    mean += weight * at;
    square += weight * at * at;
  }
  mean /= weights;
  const double variance = square / weights - mean * mean + kPixelVariance;
  // That no place beyond the ends was asked about is no information.
  const double flat_mean = 0.5 * (count - 1) - s.inner_px - 0.5, flat_variance = rgbVariance(count);
  OutlinePlace place{s.sample, s.u_px, s.outwards};
  place.information = 1 / variance - 1 / flat_variance;
  if (!(place.information > 0.02)) return {s.sample, s.u_px, s.outwards, 0, 0};
  place.mean_px = (mean / variance - flat_mean / flat_variance) / place.information;
  return place;
}

void OutlineColors::doubt(const EdgePicture& picture, const SampleSides& s, float doubt,
                          EdgeObservation& o) const {
  std::array<float, kPlaces> log_likelihood;
  const int count = likelihoods(picture, s, log_likelihood);
  const float best = *std::max_element(log_likelihood.begin(), log_likelihood.begin() + count);
  const double sign = o.normal.dot(s.outwards) < 0 ? -1 : 1;
  for (int k = 0; k < o.candidate_count; ++k) {
    EdgeCandidate& c = o.candidates[static_cast<size_t>(k)];
    const double at = sign * c.offset_px + s.inner_px + 0.5;
    // Half a pixel either way: a pixel of the outline is a mixture.
    const int low = std::clamp(static_cast<int>(std::floor(at)), 0, count - 1);
    const int high = std::clamp(low + 1, 0, count - 1);
    if (std::max(log_likelihood[static_cast<size_t>(low)],
                 log_likelihood[static_cast<size_t>(high)]) < best - doubt)
      c.like_before = false;
  }
}

CueEquations RegionCue::linearise(const SE3& T) {
  const Matrix3d R = T.rotationMatrix();
  CueEquations equations;
  std::vector<Vector6d> jacobians(places_.size());
  std::vector<double> residuals(places_.size()), scaled;
  for (size_t i = 0; i < places_.size(); ++i) {
    const OutlinePlace& place = places_[i];
    if (!(place.information > 0)) continue;
    const Vector3d& p = model_.samples[static_cast<size_t>(place.sample)].p;
    const auto projection = camera_.projectWithJacobian(R * p + T.translation);
    if (!projection) continue;
    const double by_sigma = std::sqrt(place.information);
    residuals[i] = by_sigma * (place.outwards.dot(projection->u_px - place.u_px) - place.mean_px);
    const Vector3d a = by_sigma * (place.outwards.transpose() * projection->J * R).transpose();
    jacobians[i] << a, p.cross(a);
    scaled.push_back(std::abs(residuals[i]));
  }
  equations.residuals = static_cast<int>(scaled.size());
  const double scale = std::max(robustScale(scaled), kSmallestScale);
  SideErrors errors(camera_, T);
  for (size_t i = 0; i < places_.size(); ++i) {
    const OutlinePlace& place = places_[i];
    if (!(place.information > 0)) continue;
    const double weight = tukeyWeight(residuals[i] / scale, options_.tukey_constant) /
                          (scale * scale * options_.region_correlation);
    if (!(weight > 0)) continue;
    equations.add(jacobians[i], residuals[i], weight);
    errors.add(place.outwards, place.u_px, std::sqrt(place.information) * weight * jacobians[i]);
  }
  equations.shared = errors.shared(options_.edge_offset_px);
  return equations;
}

}  // namespace diorama
