#include "tracker/edge_search.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

namespace diorama {
namespace {

constexpr int kMaxCandidatesFound = EdgeProfile::kMaxRange + 1;  // of two neighbours one at most
constexpr double kImageMargin = 6;  // px; samples nearer to the outline are not looked for
constexpr int kCell = 4;            // px
// Colours are noisier than grey values, and often of half the resolution: they must tell more.
constexpr float kMuchMore = 1.3f;

// Profiles of smeared edges: longer ones would meet what lies beside the object.
constexpr double kLongestStep = 3;  // px
constexpr int kSmearedRange = 6;    // steps

// The sector of a direction in the image: four of each quadrant.
size_t sideOf(const Vector2d& direction) {
  constexpr double kTan22 = std::numbers::sqrt2 - 1;  // of 22.5 degrees
  const double x = std::abs(direction.x()), y = std::abs(direction.y());
  const size_t quadrant = 2 * (direction.x() < 0) + (direction.y() < 0);
  return 4 * quadrant + (y > kTan22 * x) + (y > x) + (kTan22 * y > x);
}

// Half the height of the strongest edge; 0 for none.
float strongestOf(const EdgeCandidate* edges, int count) {
  float strongest = 0;
  for (int k = 0; k < count; ++k)
    strongest = std::max(strongest, std::abs(edges[k].contrast.gradient));
  return strongest;
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

}  // namespace

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
  const auto addSamples = [&](const ModelEdge& edge) {
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
  };
  std::vector<uint8_t> contour;
  findContour(model_, eye, contour);
  for (size_t i = 0; i < contour.size(); ++i)
    if (contour[i]) addSamples(model_.edges[i]);
  for (const int i : model_.sharp_edges)
    if (!contour[static_cast<size_t>(i)]) addSamples(model_.edges[static_cast<size_t>(i)]);
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

bool EdgeSearch::observe(const EdgePicture& picture, const Line& line, int range_px,
                         EdgeObservation& out) const {
  const auto [x, y] = std::pair(line.u_px.x(), line.u_px.y());
  constexpr double kMargin = 2;  // px; profiles have parallels, and are read between pixels
  const int width = picture.grey->width, height = picture.grey->height;
  const Vector2d step = out.step_px * line.normal;
  const double room = std::min(roomAlong(x, step.x(), kMargin, width - 2 - kMargin),
                               roomAlong(y, step.y(), kMargin, height - 2 - kMargin));
  if (!(room >= EdgeProfile::kMargin + 1)) return false;
  const int range =
      std::min({out.step_px == 1 ? range_px : std::min(range_px, kSmearedRange),
                EdgeProfile::kMaxRange, static_cast<int>(room) - EdgeProfile::kMargin});

  EdgeProfile profile;
  readGreyProfile(*picture.grey, line.u_px, step, range, profile);
  EdgeCandidate found[kMaxCandidatesFound];
  const float least = static_cast<float>(options_.min_contrast / 2);
  int count = findProfileEdges(profile, least, found, kMaxCandidatesFound);
  const float strongest = strongestOf(found, count);
  if (picture.rgb && strongest < options_.plain_contrast / 2) {
    readColorProfile(*picture.rgb, line.u_px, step, profile);
    EdgeCandidate colored[kMaxCandidatesFound];
    const int colored_count = findProfileEdges(profile, least, colored, kMaxCandidatesFound);
    if (strongestOf(colored, colored_count) > kMuchMore * strongest)
      std::copy(colored, colored + (count = colored_count), found);
  }
  out.candidate_count = std::min(count, EdgeObservation::kMaxCandidates);
  std::partial_sort_copy(found, found + count, out.candidates.begin(), out.candidates.end(),
                         options_.nearest_edges ? nearer : strongerEdge);
  for (EdgeCandidate& candidate : out.candidates) candidate.offset_px *= out.step_px;
  return count > 0;
}

// The derivative of a profile reaches over four steps, which should be as long as the smear.
int EdgeSearch::smearStep(const SE3& T_before, int sample, const Line& line) const {
  const auto before = camera_.project(T_before * model_.samples[static_cast<size_t>(sample)].p);
  if (!before) return 1;
  const double smear_px = std::abs(line.normal.dot(line.u_px - *before));
  return static_cast<int>(std::clamp(std::round(smear_px / 4), 1.0, kLongestStep));
}

std::vector<EdgeObservation> EdgeSearch::search(const EdgePicture& picture, const SE3& T,
                                                const std::vector<int>& samples,
                                                const std::vector<Contrast>& memory, int range_px,
                                                const std::optional<SE3>& T_before) const {
  const Matrix3d R = T.rotationMatrix();
  const Vector3d eye = T.inverse().translation;
  std::vector<EdgeObservation> observations;
  observations.reserve(samples.size());
  for (const int index : samples) {
    const auto line = projectSample(T, R, index);
    if (!line) continue;
    EdgeObservation observation;
    if (T_before) observation.step_px = smearStep(*T_before, index, *line);
    if (!observe(picture, *line, range_px, observation)) continue;
    observation.sample = index;
    observation.contour = onContour(index, eye);
    observation.u_px = line->u_px;
    observation.normal = line->normal;
    observations.push_back(observation);
  }
  compareContrast(memory, observations);
  return observations;
}

std::vector<SampleSides> EdgeSearch::sidesOf(const SE3& T, const std::vector<int>& samples,
                                             int near_px, int far_px, bool outline_only) const {
  const Matrix3d R = T.rotationMatrix();
  const Matrix3d R_model_camera = R.transpose();
  const Vector3d eye = T.inverse().translation, origin = eye + model_.centre_object;
  const double behind = 1 + 2 * model_.diameter / std::max(T.translation.z(), 1e-3);
  std::vector<SampleSides> sides;
  std::vector<Vector3d> points;
  for (const int index : samples) {
    if (outline_only && !onContour(index, eye)) continue;
    const auto line = projectSample(T, R, index);
    if (!line || !camera_.contains(line->u_px, far_px + 2)) continue;
    sides.push_back({index, line->u_px, line->normal});
    const Vector3d p = R * model_.samples[static_cast<size_t>(index)].p + T.translation;
    const Vector3d pixel = p.z() / camera_.fx() * Vector3d(line->normal.x(), line->normal.y(), 0);
    for (const int px : {-far_px, -near_px, near_px, far_px})
      points.push_back(R_model_camera * (behind * (p + px * pixel)) + origin);
  }
  std::vector<uint8_t> on_object(points.size());
  rays_.occluded(object_, origin, points, on_object);
  size_t kept = 0;
  for (size_t i = 0; i < sides.size(); ++i) {
    const auto [far_before, before, after, far_after] = std::array{
        on_object[4 * i], on_object[4 * i + 1], on_object[4 * i + 2], on_object[4 * i + 3]};
    const bool outline = before != after;
    if (outline_only ? !outline : !before && !after) continue;
    SampleSides& s = sides[kept++] = sides[i];
    s.outline = outline;
    s.inner_px = far_before == before ? far_px : near_px;
    s.outer_px = far_after == after ? far_px : near_px;
    if (before) continue;
    s.outwards = -s.outwards;
    std::swap(s.inner_px, s.outer_px);
  }
  sides.resize(kept);
  return sides;
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

SideErrors::SideErrors(const Camera& camera, const SE3& T)
    : middle_px_(camera.project(T.translation).value_or(Vector2d::Zero())) {
  gradients_.fill(Vector6d::Zero());
}

void SideErrors::add(const Vector2d& normal, const Vector2d& u_px, const Vector6d& weighted) {
  const double outwards = normal.dot(u_px - middle_px_) < 0 ? -1 : 1;
  gradients_[sideOf(outwards * normal)] += outwards * weighted;
}

Matrix6d SideErrors::shared(double offset_px) const {
  Matrix6d sum = Matrix6d::Zero();
  for (const Vector6d& gradient : gradients_)
    sum.noalias() += (offset_px * offset_px * gradient) * gradient.transpose();
  return sum;
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
  SideErrors errors(camera_, T);
  for (size_t i = 0; i < observations_.size(); ++i) {
    const EdgeObservation& o = observations_[i];
    if (o.chosen < 0) continue;
    const double weight = tukeyWeight(o.residual_px / equations.sigma_px, options_.tukey_constant) /
                          (equations.sigma_px * equations.sigma_px * options_.edge_correlation);
    if (!(weight > 0)) continue;
    equations.add(jacobians[i], o.residual_px, weight);
    errors.add(o.normal, o.u_px, weight * jacobians[i]);
  }
  equations.shared = errors.shared(options_.edge_offset_px);
  return equations;
}

}  // namespace diorama
