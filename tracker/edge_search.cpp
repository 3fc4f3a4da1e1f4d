#include "tracker/edge_search.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "tracker/image_pyramid.h"

namespace diorama {
namespace {

constexpr int kProfileMargin = 3;  // px on each side, for the derivative and the grey values
constexpr int kMaxRange = 32;      // px; the paper's maximum error
constexpr int kMaxCandidatesFound = 2 * kMaxRange + 1;
constexpr double kImageMargin = 6;  // px; samples nearer to the outline are not looked for
constexpr int kCell = 4;            // px
// The extremum of a step with a ramp behind it moves by half the variance of the smoothing (pixel,
// profile, derivative: 1 to 2 px^2) times the ramp over the step, which looks smaller from there.
constexpr float kRampShift_px = 1;
constexpr int kTangentTaps = 1;  // on each side: profiles are averaged over 3 parallels

constexpr size_t kSides = 16;

// The sector of a direction in the image.
size_t sideOf(const Vector2d& direction) {
  const double turn = std::atan2(direction.y(), direction.x()) / (2 * std::numbers::pi) + 0.5;
  return static_cast<size_t>(turn * kSides) % kSides;
}

bool stronger(const EdgeCandidate& a, const EdgeCandidate& b) {
  return std::abs(a.contrast.gradient) > std::abs(b.contrast.gradient);
}

bool nearer(const EdgeCandidate& a, const EdgeCandidate& b) {
  return std::abs(a.offset_px) < std::abs(b.offset_px);
}

// Median ratio of the grey values beside the nearest edges to the remembered ones; 1 when little is
// remembered.
float brightnessAgainst(const std::vector<Contrast>& memory,
                        const std::vector<EdgeObservation>& observations) {
  constexpr size_t kFewest = 16;
  constexpr float kDark = 8;  // grey levels; darker values have no ratio worth the name
  std::vector<float> ratios;
  for (const EdgeObservation& o : observations) {
    const Contrast& known = memory[static_cast<size_t>(o.sample)];
    const float before = known.before + known.after;
    if (known.gradient == 0 || before < kDark) continue;
    const auto end = o.candidates.begin() + o.candidate_count;
    const auto nearest = std::min_element(o.candidates.begin(), end, nearer);
    ratios.push_back((nearest->contrast.before + nearest->contrast.after) / before);
  }
  if (ratios.size() < kFewest) return 1;
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  return *middle;
}

// How far one can go from x along a direction before leaving [lowest, highest].
double roomAlong(double x, double direction, double lowest, double highest) {
  const double room = std::min(x - lowest, highest - x);
  return room <= 0 ? -1 : room / std::max(std::abs(direction), 1e-6);
}

// Cameras code about the root of the light.
float lightOf(float grey) { return grey * grey; }

// Sub-pixel place of the maximum that is uphill from i, a step away at most, by a parabola.
template <class Value>
float peakNear(int i, int first, int last, const Value& value) {
  if (i < last && value(i + 1) > value(i) && value(i + 1) >= value(i - 1))
    ++i;
  else if (i > first && value(i - 1) > value(i))
    --i;
  const float l = value(i - 1), m = value(i), r = value(i + 1), curvature = l - 2 * m + r;
  const float shift = curvature < -1e-6f * m ? 0.5f * (l - r) / curvature : 0;
  return static_cast<float>(i) + std::clamp(shift, -0.5f, 0.5f);
}

// How much more the values go on rising behind a step at x than before it, over the step.
template <class Value>
float rampBehind(float x, int length, const Value& value) {
  const auto at = [&](float place) {
    const float inside = std::clamp(place, 0.f, static_cast<float>(length) - 1.001f);
    const int k = static_cast<int>(inside);
    return value(k) + (inside - static_cast<float>(k)) * (value(k + 1) - value(k));
  };
  const float before = at(x - 1), after = at(x + 1), step = after - before;
  const float ramp = (at(x + 3) - after) - (before - at(x - 3));
  return std::abs(ramp) >= std::abs(step) ? std::copysign(1.f, ramp * step) : ramp / step;
}

}  // namespace

int findProfileEdges(const float* profile, int length, float min_gradient, EdgeCandidate* out,
                     int capacity) {
  // Smoothed central difference: a step of height h gives h / 2 at its place.
  const auto derivative = [&](int i, const auto& value) {
    return (2 * (value(i + 1) - value(i - 1)) + value(i + 2) - value(i - 2)) / 6;
  };
  const auto light = [&](int i) { return lightOf(profile[i]); };
  const auto change = [&](int i) { return derivative(i, [&](int k) { return profile[k]; }); };
  const auto light_change = [&](int i) { return std::abs(derivative(i, light)); };
  const int middle = length / 2, last = length - 1 - kProfileMargin;
  int count = 0;
  float left = change(2), here = change(3);
  for (int i = kProfileMargin; i <= last; ++i) {
    const float right = change(i + 1), m = std::abs(here);
    if (m >= min_gradient && m >= std::abs(left) && m > std::abs(right)) {
      const float peak = peakNear(i, kProfileMargin, last, light_change);
      const float ramp = rampBehind(peak, length, light);
      const float edge = peak - kRampShift_px * ramp;
      const EdgeCandidate found{static_cast<double>(edge - static_cast<float>(middle)),
                                {here, 0.5f * (profile[i - 2] + profile[i - 3]),
                                 0.5f * (profile[i + 2] + profile[i + 3])},
                                true};
      if (count < capacity) {
        out[count++] = found;
      } else {
        EdgeCandidate* weakest = std::max_element(out, out + count, stronger);
        if (stronger(found, *weakest)) *weakest = found;
      }
    }
    left = here;
    here = right;
  }
  return count;
}

EdgeSearch::EdgeSearch(const EdgeModel& model, const Camera& camera, const RayQuery& rays,
                       int object, const TrackerOptions& options)
    : model_(model), camera_(camera), rays_(rays), object_(object), options_(options) {}

std::vector<int> EdgeSearch::visibleSamples(const SE3& T, int max_samples) const {
  const Vector3d eye = T.inverse().translation;
  std::vector<int> samples = samplesInImage(T, eye);
  std::vector<Vector3d> points(samples.size());
  std::vector<uint8_t> hidden(samples.size());
  for (size_t i = 0; i < samples.size(); ++i)
    points[i] = model_.samples[static_cast<size_t>(samples[i])].p + model_.centre_object;
  rays_.occluded(object_, eye + model_.centre_object, points, hidden);
  size_t kept = 0;
  for (size_t i = 0; i < samples.size(); ++i)
    if (!hidden[i]) samples[kept++] = samples[i];
  samples.resize(kept);
  const size_t limit = static_cast<size_t>(max_samples);
  if (samples.size() > limit) {  // evenly thinned
    for (size_t i = 0; i < limit; ++i) samples[i] = samples[i * kept / limit];
    samples.resize(limit);
  }
  return samples;
}

bool EdgeSearch::onContour(const ModelEdge& edge, const Vector3d& eye) const {
  const Vector3d view = model_.vertices[static_cast<size_t>(edge.a)] - eye;
  return edge.kind == EdgeKind::kBoundary || edge.n1.dot(view) * edge.n2.dot(view) <= 0;
}

// Samples that project into the image, whether hidden or not, but one at most per small cell:
// rounded creases of a model are several edges side by side, which see the same image edge. Contour
// edges come first, since their place does not depend on the light.
std::vector<int> EdgeSearch::samplesInImage(const SE3& T, const Vector3d& eye) const {
  const Matrix3d R = T.rotationMatrix();
  const double depth = std::max(T.translation.z(), 0.1 * model_.diameter);
  const double spacing_px = model_.sample_spacing * std::max(camera_.fx(), camera_.fy()) / depth;
  const double step = options_.sample_step_m > 0 ? options_.sample_step_m / model_.sample_spacing
                                                 : options_.sample_step_px / spacing_px;
  const int stride = static_cast<int>(std::clamp(std::round(step), 1.0, 1024.0));

  Image<uint8_t> taken(camera_.width() / kCell + 1, camera_.height() / kCell + 1);
  std::vector<int> samples;
  for (const bool contour : {true, false})
    for (const ModelEdge& edge : model_.edges) {
      if (onContour(edge, eye) != contour || (edge.kind == EdgeKind::kSmooth && !contour)) continue;
      for (int k = std::min(stride, edge.sample_count) / 2; k < edge.sample_count; k += stride) {
        const int index = edge.first_sample + k;
        const auto u =
            camera_.project(R * model_.samples[static_cast<size_t>(index)].p + T.translation);
        if (!u || !camera_.contains(*u, kImageMargin)) continue;
        uint8_t& cell = taken(static_cast<int>(u->x()) / kCell, static_cast<int>(u->y()) / kCell);
        if (cell) continue;
        cell = 1;
        samples.push_back(index);
      }
    }
  return samples;
}

std::optional<EdgeSearch::Line> EdgeSearch::projectSample(const SE3& T, const Matrix3d& R,
                                                          int index) const {
  const EdgeSample& sample = model_.samples[static_cast<size_t>(index)];
  const ModelEdge& edge = model_.edges[static_cast<size_t>(sample.edge)];
  const auto projection = camera_.projectWithJacobian(R * sample.p + T.translation);
  if (!projection) return std::nullopt;
  const Matrix23d J = projection->J * R;
  if (edge.kind == EdgeKind::kSmooth) {
    // The rim's normal comes from the surface, not from the zigzag of the mesh edges along it.
    const Vector2d normal = J * (edge.n1 + edge.n2);
    if (!(normal.norm() > 1e-6)) return std::nullopt;
    return Line{projection->u_px, normal.normalized()};
  }
  const Vector2d along = J * sample.direction;
  const double length = along.norm();  // px/m
  // An edge seen almost end-on has no direction in the image.
  if (!(length > 0.15 * camera_.fx() / T.translation.z())) return std::nullopt;
  return Line{projection->u_px, Vector2d(-along.y(), along.x()) / length};
}

bool EdgeSearch::observe(const Image<uint8_t>& image, const Line& line, int range_px,
                         EdgeObservation& out) const {
  const auto [x, y] = std::pair(line.u_px.x(), line.u_px.y());
  const double margin = kTangentTaps + 1;
  const double room = std::min(roomAlong(x, line.normal.x(), margin, image.width - 2 - margin),
                               roomAlong(y, line.normal.y(), margin, image.height - 2 - margin));
  if (!(room >= kProfileMargin + 1)) return false;
  const int range = std::min({range_px, kMaxRange, static_cast<int>(room) - kProfileMargin});

  float profile[2 * (kMaxRange + kProfileMargin) + 1];
  const int half = range + kProfileMargin, length = 2 * half + 1;
  const float nx = static_cast<float>(line.normal.x()), ny = static_cast<float>(line.normal.y());
  for (int i = 0; i < length; ++i) {
    const float px = static_cast<float>(x) + static_cast<float>(i - half) * nx;
    const float py = static_cast<float>(y) + static_cast<float>(i - half) * ny;
    float sum = 0;
    for (int k = -kTangentTaps; k <= kTangentTaps; ++k)
      sum += sampleBilinear(image, px - static_cast<float>(k) * ny, py + static_cast<float>(k) * nx,
                            lightOf);
    profile[i] = std::sqrt(sum / (2 * kTangentTaps + 1));
  }

  EdgeCandidate found[kMaxCandidatesFound];
  const int count = findProfileEdges(profile, length, static_cast<float>(options_.min_contrast / 2),
                                     found, kMaxCandidatesFound);
  out.candidate_count = std::min(count, EdgeObservation::kMaxCandidates);
  std::partial_sort_copy(found, found + count, out.candidates.begin(), out.candidates.end(),
                         options_.nearest_edges ? nearer : stronger);
  return count > 0;
}

std::vector<EdgeObservation> EdgeSearch::search(const Image<uint8_t>& image, const SE3& T,
                                                const std::vector<int>& samples,
                                                const std::vector<Contrast>& memory,
                                                int range_px) const {
  const Matrix3d R = T.rotationMatrix();
  const Vector3d eye = T.inverse().translation;
  std::vector<EdgeObservation> observations;
  observations.reserve(samples.size());
  for (const int index : samples) {
    const auto line = projectSample(T, R, index);
    if (!line) continue;
    EdgeObservation observation;
    if (!observe(image, *line, range_px, observation)) continue;
    observation.sample = index;
    observation.contour = onContour(index, eye);
    observation.u_px = line->u_px;
    observation.normal = line->normal;
    observations.push_back(observation);
  }
  compareContrast(memory, observations);
  return observations;
}

// Marks candidates of which neither side looks as remembered. When the light has changed, all of
// them are brighter or darker in the same proportion.
void EdgeSearch::compareContrast(const std::vector<Contrast>& memory,
                                 std::vector<EdgeObservation>& observations) const {
  const float gain = brightnessAgainst(memory, observations);
  const float tolerance = static_cast<float>(options_.contrast_tolerance);
  for (EdgeObservation& o : observations) {
    const Contrast& known = memory[static_cast<size_t>(o.sample)];
    if (known.gradient == 0) continue;
    for (EdgeCandidate& c : o.candidates)
      c.like_before = std::min(std::abs(c.contrast.before - gain * known.before),
                               std::abs(c.contrast.after - gain * known.after)) <= tolerance;
  }
}

CueEquations EdgeCue::linearise(const SE3& T) {
  const Matrix3d R = T.rotationMatrix();
  CueEquations equations;
  std::vector<Vector6d> jacobians(observations_.size());
  absolute_.clear();
  for (size_t i = 0; i < observations_.size(); ++i) {
    EdgeObservation& o = observations_[i];
    o.chosen = -1;
    const Vector3d& p = model_.samples[static_cast<size_t>(o.sample)].p;
    const auto projection = camera_.projectWithJacobian(R * p + T.translation);
    if (!projection) continue;
    const double moved = o.normal.dot(projection->u_px - o.u_px);
    double smallest = 1e9;
    for (int k = 0; k < o.candidate_count; ++k) {
      const EdgeCandidate& c = o.candidates[static_cast<size_t>(k)];
      const double distance =
          std::abs(moved - c.offset_px) + (c.like_before ? 0 : options_.contrast_penalty_px);
      if (distance >= smallest) continue;
      smallest = distance;
      o.chosen = k;
      o.residual_px = moved - c.offset_px;
    }
    if (o.chosen < 0) continue;
    const Vector3d a = (o.normal.transpose() * projection->J * R).transpose();
    jacobians[i] << a, p.cross(a);
    absolute_.push_back(std::abs(o.residual_px));
  }
  equations.residuals = static_cast<int>(absolute_.size());
  equations.sigma_px = std::max(robustScale(absolute_), smallest_sigma_px_);
  // Rims, shadows and highlights displace a whole side of an outline alike.
  std::array<Vector6d, kSides> side_gradients;
  side_gradients.fill(Vector6d::Zero());
  const Vector2d middle = camera_.project(T.translation).value_or(Vector2d::Zero());
  for (size_t i = 0; i < observations_.size(); ++i) {
    const EdgeObservation& o = observations_[i];
    if (o.chosen < 0) continue;
    const double weight = tukeyWeight(o.residual_px / equations.sigma_px, options_.tukey_constant) /
                          (equations.sigma_px * equations.sigma_px * options_.edge_correlation);
    if (!(weight > 0)) continue;
    equations.add(jacobians[i], o.residual_px, weight);
    const double outwards = o.normal.dot(o.u_px - middle) < 0 ? -1 : 1;
    side_gradients[sideOf(outwards * o.normal)] += outwards * weight * jacobians[i];
  }
  const double variance = options_.edge_offset_px * options_.edge_offset_px;
  for (const Vector6d& gradient : side_gradients)
    equations.shared.noalias() += (variance * gradient) * gradient.transpose();
  return equations;
}

}  // namespace diorama
