#include "tracker/pose_refiner.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace diorama {
namespace {

// Standard deviations of a direction that nothing was measured about.
constexpr double kUnknownSigmaM = 1.0;
constexpr double kUnknownSigmaRad = 1.0;

// How much a view may change, before the print is seen anew: by 8 degrees, or this factor.
constexpr double kPrintView = 0.99, kPrintScale = 1.2;

constexpr double kClearlyBetter = 0.5;  // by the factor e^0.5, one sample in a hundred

// Some edges of other things are taken for the object's: the more, the less of it is to be seen,
// and the fewer of its edges agree. Factor of the covariance.
double doubtOf(const VisibleSamples& visible, const TrackHealth& health) {
  constexpr double kUsual = 0.65, kLeast = 0.05;  // agreement
  const double lack = std::max(1.0, kUsual / std::max(health.edge_agreement, kLeast));
  return lack * lack / visible.familiar_share;
}

constexpr double kAlike = 0.02;  // fit: by so much less a pose is less likely by the factor e

double logPosterior(const Estimate& estimate, const std::optional<PosePrior>& prior) {
  return estimate.fit / kAlike + (prior ? prior->logDensity(estimate.T_camera_model) : 0);
}

// Poses that are about as likely are possible, too.
void addSpread(const std::vector<Estimate>& others, const std::optional<PosePrior>& prior,
               Estimate& best) {
  const SE3 T_best_camera = best.T_camera_model.inverse();
  const double most = logPosterior(best, prior);
  double weights = 1;
  Matrix6d spread = Matrix6d::Zero();
  for (const Estimate& other : others) {
    const double weight = std::exp(std::min(0.0, logPosterior(other, prior) - most));
    const Vector6d away = log(T_best_camera * other.T_camera_model);
    weights += weight;
    spread += weight * away * away.transpose();
  }
  best.covariance += spread / weights;
}

}  // namespace

bool Estimate::isSharperThan(const Estimate& other) const {
  constexpr double kClearly = 1.2;
  if (print_sigma_px > 0 && other.print_sigma_px > 0) {
    if (other.print_sigma_px > kClearly * print_sigma_px) return true;
    if (print_sigma_px > kClearly * other.print_sigma_px) return false;
  }
  return fit > other.fit;
}

std::optional<PosePrior> independentPrior(const ObjectPrediction& start, const EdgeModel& model) {
  if (!start.independent) return std::nullopt;
  const SE3 shift{Eigen::Quaterniond::Identity(), model.centre_object};
  const Matrix6d move = adjoint(shift);
  return PosePrior{start.T_camera_object * shift,
                   move.transpose() * start.covariance.llt().solve(move), true};
}

PoseRefiner::PoseRefiner(const EdgeModel& model, const Mesh& mesh, const Camera& camera,
                         const RayQuery& rays, int object, const TrackerOptions& options)
    : model_(model),
      camera_(camera),
      options_(options),
      search_(model, camera, rays, object, options),
      selection_(model, mesh, camera, rays, object, search_, options),
      texture_(model, camera, rays, object, options, options.texture_correlation),
      print_(options.print_patches > 0 ? mesh : Mesh(), model.centre_object, camera, rays, object),
      printed_(model, camera, rays, object, options, options.print_correlation),
      memory_(model.samples.size()) {}

Estimate PoseRefiner::refine(const SE3& start, const std::vector<int>& search_ranges_px,
                             const std::optional<PosePrior>& prior) {
  Estimate estimate;
  SE3& T = estimate.T_camera_model = start;
  SE3 T_samples, T_texture;
  SampleSelection::Samples samples;
  std::vector<OutlineLikelihood> outline;
  const auto selectSamples = [&] {
    samples = selection_.at(T_samples = T, options_.max_samples);
    outline = selection_.outlineAt(T, samples.used);
  };
  const auto search = [&](int range_px) {
    estimate.observations =
        search_.search(*picture_, T, samples.used, memory_, range_px, T_before_);
    doubtEdges(outline, options_.region_doubt, estimate.observations);
  };
  selectSamples();
  seePrint(T);
  alignPatches(T_texture = T);
  PriorCue expected(prior.value_or(PosePrior()));
  SolverLimits limits = solverLimits();
  PoseSolution solution;
  for (size_t round = 0; round < search_ranges_px.size(); ++round) {
    const bool last = round + 1 == search_ranges_px.size();
    if (pixelMotion(T, T_samples) > 4) selectSamples();
    if (pixelMotion(T, T_texture) > 3) alignPatches(T_texture = T);
    search(search_ranges_px[round]);
    EdgeCue edges(model_, camera_, options_, estimate.observations,
                  last ? options_.narrow_sigma_px : options_.wide_sigma_px);
    RegionCue region(model_, camera_, options_, outline);
    Cue* const cues[] = {&edges, &texture_, &printed_, &region, &expected};
    limits.motion = motionWithin(search_ranges_px[round], T, samples.used);
    solution = solvePose(T, cues, limits);
    T = solution.T_camera_model;
  }
  setCovariance(solution, prior, estimate);
  search(kHealthRange);
  const VisibleSamples visible = countSamples(samples, T);
  estimate.samples = std::move(samples.used);
  estimate.health = assessHealth(visible, estimate.observations, texture_, printed_, options_);
  estimate.covariance *= doubtOf(visible, estimate.health);
  estimate.fit = fitOf(visible, estimate.observations);
  return estimate;
}

void PoseRefiner::seePrint(const SE3& T) {
  if (!print_.empty() && printed_.viewChanged(T, kPrintView, kPrintScale))
    printed_.setPatches(print_.patchesSeenFrom(T, options_.print_patches), T);
}

void PoseRefiner::alignPatches(const SE3& T) {
  for (TextureCue* cue : {&texture_, &printed_}) cue->align(*picture_->grey, T, coverAt(T));
}

// The solution's cues: edges, texture, print, region, prior.
void PoseRefiner::setCovariance(const PoseSolution& solution, const std::optional<PosePrior>& prior,
                                Estimate& estimate) const {
  const CueEquations &edges = solution.cues[0], &print = solution.cues[2],
                     &region = solution.cues[3];
  const SE3& T = solution.T_camera_model;
  estimate.by_prediction = prior.has_value();
  estimate.edges = edges;
  estimate.given_keyframe = texture_.givenKeyframe();
  estimate.print_sigma_px = print.residuals >= 2 * kFewestPatches ? print.sigma_px : 0;
  estimate.by_image = solution.hessian() - solution.cues.back().hessian;
  estimate.own_covariance =
      covarianceFromHessian(solution.hessian(), kUnknownSigmaM, kUnknownSigmaRad);
  // Texture is told by poses of earlier frames, whose edges were displaced likewise: the edges and
  // the region alone, the print, and what was known before, say what the shared errors come to.
  const Matrix6d known =
      prior && prior->independent ? prior->weightOf(T) * prior->information : known_;
  const Matrix6d by_outline = covarianceFromHessian(
      edges.hessian + print.hessian + region.hessian + known, kUnknownSigmaM, kUnknownSigmaRad);
  estimate.covariance = estimate.own_covariance +
                        by_outline * (edges.shared + region.shared) * by_outline.transpose();
}

Estimate PoseRefiner::refineSmeared(const SE3& start, const SE3& T_before,
                                    const std::optional<PosePrior>& prior) {
  T_before_ = T_before;
  Estimate estimate = refine(start, prior);
  T_before_.reset();
  return estimate;
}

double PoseRefiner::fitOf(const VisibleSamples& visible,
                          const std::vector<EdgeObservation>& observations) const {
  double sum = 0;
  for (const EdgeObservation& o : observations) {
    double nearest = kHealthRange * o.step_px;
    for (int k = 0; k < o.candidate_count; ++k) {
      const EdgeCandidate& c = o.candidates[static_cast<size_t>(k)];
      if (c.like_before) nearest = std::min(nearest, std::abs(c.offset_px));
    }
    const double scaled = nearest / (o.step_px * options_.fit_sigma_px);
    sum += (o.contour ? 1 : kCreaseWeight) * std::exp(-0.5 * scaled * scaled);
  }
  return sum / std::max(1.0, static_cast<double>(visible.contour) +
                                 kCreaseWeight * static_cast<double>(visible.crease));
}

// Two in each principal direction, so far that the edges move by neighbour_px (rms) along their
// normals, but not the surface by much more: round things may turn, and their edges stay.
std::vector<SE3> PoseRefiner::neighboursOf(const Estimate& estimate) const {
  const SE3& T = estimate.T_camera_model;
  const double unit = 0.35 * model_.diameter;  // m that move the edges about as far as 1 rad
  Vector6d scale;
  scale << unit, unit, unit, 1, 1, 1;
  const Eigen::SelfAdjointEigenSolver<Matrix6d> principal(
      Matrix6d(scale.asDiagonal() * estimate.edges.hessian * scale.asDiagonal()));
  std::vector<SE3> neighbours;
  for (int k = 0; k < 4; ++k) {
    const Vector6d direction = scale.cwiseProduct(principal.eigenvectors().col(k));
    constexpr double kSmall = 1e-3, kMostMotion = 4;
    const SE3 near = T * exp(kSmall * direction);
    const double steps = std::min(options_.neighbour_px / edgeMotion(estimate.observations, near),
                                  kMostMotion * options_.neighbour_px / pixelMotion(near, T));
    if (!std::isfinite(steps)) continue;
    const Vector6d step = steps * kSmall * direction;
    for (const double sign : {1.0, -1.0}) neighbours.push_back(T * exp(sign * step));
  }
  return neighbours;
}

// Rms motion along their normals of the samples, px.
double PoseRefiner::edgeMotion(const std::vector<EdgeObservation>& observations,
                               const SE3& T) const {
  const Matrix3d R = T.rotationMatrix();
  double sum = 0;
  int count = 0;
  for (const EdgeObservation& o : observations) {
    const auto u =
        camera_.project(R * model_.samples[static_cast<size_t>(o.sample)].p + T.translation);
    if (!u) continue;
    const double moved = o.normal.dot(*u - o.u_px);
    sum += moved * moved;
    ++count;
  }
  return count > 0 ? std::sqrt(sum / count) : 0;
}

Estimate PoseRefiner::searchNeighbours(Estimate best, const std::optional<PosePrior>& prior) {
  std::vector<Estimate> others;
  for (int round = 0; round < options_.neighbour_rounds; ++round) {
    others.clear();
    for (const SE3& start : neighboursOf(best)) {
      Estimate other = refine(start, prior);
      if (best.print_sigma_px > 0 && !(other.print_sigma_px > 0)) continue;
      others.push_back(std::move(other));
    }
    const auto likeliest =
        std::max_element(others.begin(), others.end(), [&](const Estimate& a, const Estimate& b) {
          return logPosterior(a, prior) < logPosterior(b, prior);
        });
    if (likeliest == others.end() ||
        logPosterior(*likeliest, prior) <= logPosterior(best, prior) + kClearlyBetter)
      break;
    std::swap(best, *likeliest);
  }
  addSpread(others, prior, best);
  return best;
}

std::vector<int> PoseRefiner::visibleSamples(const SE3& T, int max_samples) {
  return selection_.at(T, max_samples).used;
}

VisibleSamples PoseRefiner::countSamples(const SampleSelection::Samples& samples,
                                         const SE3& T) const {
  const Vector3d eye = T.inverse().translation;
  VisibleSamples count;
  count.familiar_share = samples.familiar_share;
  for (const int sample : samples.used)
    ++(search_.onContour(sample, eye) ? count.contour : count.crease);
  return count;
}

SolverLimits PoseRefiner::solverLimits() const {
  SolverLimits limits;
  limits.iterations = options_.solver_iterations;
  limits.damping = options_.damping;
  limits.model_diameter = model_.diameter;
  return limits;
}

// Edges that are found within a range tell nothing of larger motions: the mean square of the
// samples' motion, in units of the range.
Matrix6d PoseRefiner::motionWithin(double range_px, const SE3& T,
                                   const std::vector<int>& samples) const {
  constexpr size_t kEvery = 4;
  const Matrix3d R = T.rotationMatrix();
  Matrix6d sum = Matrix6d::Zero();
  double count = 0;
  for (size_t i = 0; i < samples.size(); i += kEvery) {
    const Vector3d& p = model_.samples[static_cast<size_t>(samples[i])].p;
    const auto projection = camera_.projectWithJacobian(R * p + T.translation);
    if (!projection) continue;
    const Matrix26d J = pointJacobian(projection->J, R, p);
    sum.noalias() += J.transpose() * J;
    ++count;
  }
  return sum / (std::max(1.0, count) * range_px * range_px);
}

JudgedPose PoseRefiner::judge(const SE3& start, const std::vector<int>& samples,
                              const std::vector<int>& search_ranges_px) const {
  JudgedPose judged{std::nullopt, start, std::nullopt};
  for (const int range : search_ranges_px) {
    std::vector<EdgeObservation> found =
        search_.search(*picture_, judged.T_refined, samples, memory_, range);
    EdgeCue edges(model_, camera_, options_, found, options_.wide_sigma_px);
    if (range == search_ranges_px.front()) {
      edges.linearise(start);
      judged.log_likelihood = logLikelihood(samples.size(), found);
    }
    Cue* const cues[] = {&edges};
    judged.T_refined = solvePose(judged.T_refined, cues, solverLimits()).T_camera_model;
    judged.refined_log_likelihood = logLikelihood(samples.size(), found);
  }
  return judged;
}

// exp(-lambda_e * mean distance - lambda_v * share of samples without an edge) of the paper;
// nothing where no sample is to be seen.
std::optional<double> PoseRefiner::logLikelihood(
    size_t visible_samples, const std::vector<EdgeObservation>& observations) const {
  constexpr double kFarthest = 32;  // px, of an edge that was found (paper)
  if (visible_samples == 0) return std::nullopt;
  double distance = 0;
  int valid = 0;
  for (const EdgeObservation& o : observations) {
    if (o.chosen < 0 || std::abs(o.residual_px) > kFarthest) continue;
    distance += std::abs(o.residual_px);
    ++valid;
  }
  const double mean = valid > 0 ? distance / valid : kFarthest;
  const double invalid = 1 - valid / static_cast<double>(visible_samples);
  return -options_.filter.lambda_edge * mean - options_.filter.lambda_valid * invalid;
}

Estimate PoseRefiner::refineStart(const SE3& start, const std::optional<PosePrior>& prior) {
  Estimate best = refine(start, prior);
  for (std::vector<int> ranges : {std::vector<int>{options_.start_search_px}, std::vector<int>{}}) {
    ranges.push_back(ranges.empty() ? options_.narrow_search_px : options_.wide_search_px);
    ranges.push_back(options_.narrow_search_px);
    Estimate other = refine(start, ranges, prior);
    if (other.fit > best.fit) best = std::move(other);
  }
  return best;
}

double PoseRefiner::edgeScore(const SE3& T) {
  const std::vector<int> samples = visibleSamples(T, options_.max_samples);
  if (samples.size() < static_cast<size_t>(options_.min_samples)) return 0;
  int near = 0;
  for (const EdgeObservation& o : search_.search(*picture_, T, samples, memory_, 4)) {
    bool found = false;
    for (int k = 0; k < o.candidate_count; ++k) {
      const EdgeCandidate& c = o.candidates[static_cast<size_t>(k)];
      found |= c.like_before && std::abs(c.offset_px) < 2.5;
    }
    near += found;
  }
  return near / static_cast<double>(samples.size());
}

void PoseRefiner::remember(const Estimate& estimate) {
  const SE3& T = estimate.T_camera_model;
  selection_.learn(T, estimate.samples);
  learnContrast(estimate.observations);
  texture_.correctKeyframe(estimate.given_keyframe, estimate.edges);
  if (!print_.isComplete() && texture_.keyframeNeeded(T))
    texture_.setKeyframe(*picture_->grey, T, estimate.own_covariance, coverAt(T), print_);
}

void PoseRefiner::learnContrast(const std::vector<EdgeObservation>& observations) {
  constexpr float kRate = 0.3f;  // of a running mean over some three frames
  for (const EdgeObservation& o : observations) {
    if (o.step_px > 1) continue;  // smeared
    const EdgeCandidate* nearest = nullptr;
    for (int k = 0; k < o.candidate_count; ++k) {
      const EdgeCandidate& c = o.candidates[static_cast<size_t>(k)];
      if (std::abs(c.offset_px) >= options_.inlier_px) continue;
      if (!nearest || std::abs(c.offset_px) < std::abs(nearest->offset_px)) nearest = &c;
    }
    if (!nearest) continue;
    const Contrast& seen = nearest->contrast;
    Contrast& known = memory_[static_cast<size_t>(o.sample)];
    const float rate = known.gradient == 0 ? 1 : kRate;
    known.gradient += rate * (seen.gradient - known.gradient);
    known.before += rate * (seen.before - known.before);
    known.after += rate * (seen.after - known.after);
  }
}

}  // namespace diorama
