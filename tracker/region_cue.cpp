#include "tracker/region_cue.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace diorama {
namespace {

constexpr float kMislabelled = 0.14f;   // share of the pixels whose colour tells the wrong side
constexpr float kSeldom = 1e-3f;        // share of a colour that is hardly the object's
constexpr float kUnseen = 1e-4f;        // ... of one that was never seen
constexpr float kFewestPixels = 100;    // to learn from
constexpr double kHardlyAny = 0.02;     // 1/px^2
constexpr size_t kEvery = 2;            // neighbouring normals tell the same
constexpr double kSmallestScale = 0.7;  // of residuals over their standard deviations

// Of what is spread evenly over so many pixels.
double evenVariance(double width_px) { return width_px * width_px / 12; }

void fitGaussian(OutlineLikelihood& likelihood) {
  double weights = 0, mean = 0, square = 0;
  for (int i = 0; i < likelihood.count; ++i) {
    const double weight = std::exp(likelihood.values[static_cast<size_t>(i)] - likelihood.best);
    weights += weight;
    mean += weight * i;
    square += weight * i * i;
  }
  mean /= weights;
  const double variance = square / weights - mean * mean + evenVariance(1);
  // That no place beyond the ends was asked about is no information.
  const double even_mean = 0.5 * (likelihood.count - 1);
  const double even_variance = evenVariance(likelihood.count);
  const double information = 1 / variance - 1 / even_variance;
  if (!(information > kHardlyAny)) return;
  likelihood.information = information;
  likelihood.mean_px =
      (mean / variance - even_mean / even_variance) / information - likelihood.at.inner_px - 0.5;
}

}  // namespace

void OutlineLikelihood::doubt(double doubt, EdgeObservation& o) const {
  const double sign = o.normal.dot(at.outwards) < 0 ? -1 : 1;
  const double start = at.outwards.dot(o.u_px - at.u_px) + at.inner_px + 0.5;
  for (int k = 0; k < o.candidate_count; ++k) {
    EdgeCandidate& c = o.candidates[static_cast<size_t>(k)];
    // Of the two places around: the pixel between them is a mixture.
    const int low =
        std::clamp(static_cast<int>(std::floor(start + sign * c.offset_px)), 0, count - 1);
    const int high = std::min(low + 1, count - 1);
    const float likelihood =
        std::max(values[static_cast<size_t>(low)], values[static_cast<size_t>(high)]);
    if (likelihood < best - doubt) c.like_before = false;
  }
}

void doubtEdges(const std::vector<OutlineLikelihood>& outline, double doubt,
                std::vector<EdgeObservation>& observations) {
  auto next = observations.begin();
  for (const OutlineLikelihood& likelihood : outline) {
    const auto seen = std::find_if(next, observations.end(), [&](const EdgeObservation& o) {
      return o.sample == likelihood.at.sample;
    });
    if (seen == observations.end()) continue;
    likelihood.doubt(doubt, *seen);
    next = seen + 1;
  }
}

size_t OutlineColors::colorAt(const EdgePicture& picture, const Vector2d& u_px) {
  const int x = static_cast<int>(u_px.x() + 0.5), y = static_cast<int>(u_px.y() + 0.5);
  constexpr int kShift = 4;
  static_assert(256 >> kShift == kLevels);
  const auto index = [](int r, int g, int b) {
    return static_cast<size_t>(((r >> kShift) * kLevels + (g >> kShift)) * kLevels + (b >> kShift));
  };
  if (!picture.rgb) {
    const int level = (*picture.grey)(x, y);
    return index(level, level, level);
  }
  const Rgb8& c = (*picture.rgb)(x, y);
  return index(c.r, c.g, c.b);
}

void OutlineColors::learn(const EdgePicture& picture, const std::vector<SampleSides>& outline,
                          float inside_rate, float beside_rate) {
  std::vector<float> inside(kColors), beside(kColors);
  float inner = 0, outer = 0;
  for (const SampleSides& s : outline) {
    for (int k = 1; k <= s.inner_px; ++k, ++inner)
      ++inside[colorAt(picture, s.u_px - k * s.outwards)];
    for (int k = 1; k <= s.outer_px; ++k, ++outer)
      ++beside[colorAt(picture, s.u_px + k * s.outwards)];
  }
  if (inner < kFewestPixels || outer < kFewestPixels) return;
  if (!known_) {
    for (std::vector<float>* v : {&inside_, &beside_, &ratio_}) v->assign(kColors, 0);
    inside_rate = beside_rate = 1;
    known_ = true;
  }
  for (size_t i = 0; i < kColors; ++i) {
    inside_[i] += inside_rate * (inside[i] / inner - inside_[i]);
    beside_[i] += beside_rate * (beside[i] / outer - beside_[i]);
    ratio_[i] = 0;
    if (inside_[i] + beside_[i] < 0.1f * kUnseen) continue;
    const float a = inside_[i] + kUnseen, b = beside_[i] + kUnseen;
    ratio_[i] = std::log(((1 - kMislabelled) * a + kMislabelled * b) /
                         (kMislabelled * a + (1 - kMislabelled) * b));
  }
}

OutlineLikelihood OutlineColors::compare(const EdgePicture& picture, const SampleSides& s) const {
  OutlineLikelihood likelihood;
  float sum = likelihood.values[0] = 0;
  for (int k = -s.inner_px, i = 1; k <= s.outer_px; ++k, ++i)
    likelihood.values[static_cast<size_t>(i)] = sum +=
        ratio_[colorAt(picture, s.u_px + k * s.outwards)];
  likelihood.count = s.inner_px + s.outer_px + 2;
  likelihood.best =
      *std::max_element(likelihood.values.begin(), likelihood.values.begin() + likelihood.count);
  likelihood.at = s;
  fitGaussian(likelihood);
  return likelihood;
}

bool OutlineColors::isFamiliar(const EdgePicture& picture, const SampleSides& s) const {
  const auto isKnown = [&](const Vector2d& direction, int reach) {
    int familiar = 0;
    for (int k = 1; k <= reach; ++k)
      familiar += inside_[colorAt(picture, s.u_px + k * direction)] > kSeldom;
    return 2 * familiar >= reach;
  };
  return isKnown(-s.outwards, s.inner_px) && (s.outline || isKnown(s.outwards, s.outer_px));
}

CueEquations RegionCue::linearise(const SE3& T) {
  const Matrix3d R = T.rotationMatrix();
  CueEquations equations;
  std::vector<Vector6d> jacobians(outline_.size());
  std::vector<double> residuals(outline_.size()), absolute;
  for (size_t i = 0; i < outline_.size(); i += kEvery) {
    const SampleSides& at = outline_[i].at;
    if (!(outline_[i].information > 0)) continue;
    const Vector3d& p = model_.samples[static_cast<size_t>(at.sample)].p;
    const auto projection = camera_.projectWithJacobian(R * p + T.translation);
    if (!projection) continue;
    const double by_sigma = std::sqrt(outline_[i].information);
    residuals[i] = by_sigma * (at.outwards.dot(projection->u_px - at.u_px) - outline_[i].mean_px);
    const Vector3d a = by_sigma * (at.outwards.transpose() * projection->J * R).transpose();
    jacobians[i] << a, p.cross(a);
    absolute.push_back(std::abs(residuals[i]));
  }
  equations.residuals = static_cast<int>(absolute.size());
  const double scale = std::max(robustScale(absolute), kSmallestScale);
  SideErrors errors(camera_, T);
  for (size_t i = 0; i < outline_.size(); i += kEvery) {
    const OutlineLikelihood& o = outline_[i];
    if (!(o.information > 0)) continue;
    const double weight = tukeyWeight(residuals[i] / scale, options_.tukey_constant) /
                          (scale * scale * options_.region_correlation);
    if (!(weight > 0)) continue;
    equations.add(jacobians[i], residuals[i], weight);
    errors.add(o.at.outwards, o.at.u_px, std::sqrt(o.information) * weight * jacobians[i]);
  }
  equations.shared = errors.shared(options_.edge_offset_px);
  return equations;
}

}  // namespace diorama
