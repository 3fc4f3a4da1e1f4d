#include "tracker/pose_refiner.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace diorama {
namespace {

// Standard deviations of a direction that nothing was measured about.
constexpr double kUnknownSigmaM = 1.0;
constexpr double kUnknownSigmaRad = 1.0;

}  // namespace

PoseRefiner::PoseRefiner(const EdgeModel& model, const Camera& camera, const RayQuery& rays,
                         int object, const TrackerOptions& options)
    : model_(model),
      camera_(camera),
      options_(options),
      search_(model, camera, rays, object, options),
      texture_(model, camera, rays, object, options),
      memory_(model.samples.size()) {}

Estimate PoseRefiner::refine(const SE3& start, const std::vector<int>& search_ranges_px) {
  Estimate estimate;
  estimate.T_camera_model = start;
  SE3& T = estimate.T_camera_model;
  SE3 T_samples = start, T_texture = start;
  std::vector<int> samples = search_.visibleSamples(T);
  const SolverLimits limits = solverLimits();
  texture_.align(*picture_->grey, T);

  for (size_t round = 0; round < search_ranges_px.size(); ++round) {
    const bool last = round + 1 == search_ranges_px.size();
    if (pixelMotion(T, T_samples) > 4) samples = search_.visibleSamples(T_samples = T);
    if (pixelMotion(T, T_texture) > 3) texture_.align(*picture_->grey, T_texture = T);
    estimate.observations = search_.search(*picture_, T, samples, memory_, search_ranges_px[round]);
    EdgeCue edges(model_, camera_, options_, estimate.observations,
                  last ? options_.narrow_sigma_px : options_.wide_sigma_px);
    Cue* const cues[] = {&edges, &texture_};
    const PoseSolution solution = solvePose(T, cues, limits);
    T = solution.T_camera_model;
    estimate.edges = solution.cues[0];
    estimate.own_covariance =
        covarianceFromHessian(solution.hessian(), kUnknownSigmaM, kUnknownSigmaRad);
    // Texture is told by poses of earlier frames, whose edges were displaced likewise: the edges
    // alone say what the shared errors come to.
    const Matrix6d by_edges =
        covarianceFromHessian(estimate.edges.hessian, kUnknownSigmaM, kUnknownSigmaRad);
    estimate.covariance =
        estimate.own_covariance + by_edges * estimate.edges.shared * by_edges.transpose();
  }
  estimate.observations = search_.search(*picture_, T, samples, memory_, kHealthRange);
  estimate.health =
      assessHealth(countSamples(samples, T), estimate.observations, texture_, options_);
  return estimate;
}

VisibleSamples PoseRefiner::countSamples(const std::vector<int>& samples, const SE3& T) const {
  const Vector3d eye = T.inverse().translation;
  VisibleSamples count;
  for (const int sample : samples)
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

Estimate PoseRefiner::refineStart(const SE3& start) {
  Estimate best = refine(start);
  for (std::vector<int> ranges : {std::vector<int>{options_.start_search_px}, std::vector<int>{}}) {
    ranges.push_back(ranges.empty() ? options_.narrow_search_px : options_.wide_search_px);
    ranges.push_back(options_.narrow_search_px);
    Estimate other = refine(start, ranges);
    if (other.health.value > best.health.value) best = std::move(other);
  }
  return best;
}

double PoseRefiner::edgeScore(const SE3& T) const {
  const std::vector<int> samples = search_.visibleSamples(T);
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
  learnContrast(estimate.observations);
  texture_.correctKeyframe(estimate.edges);
  if (texture_.empty() || texture_.keyframeNeeded(estimate.T_camera_model))
    texture_.setKeyframe(*picture_->grey, estimate.T_camera_model, estimate.own_covariance);
}

void PoseRefiner::learnContrast(const std::vector<EdgeObservation>& observations) {
  constexpr float kRate = 0.3f;  // of a running mean over some three frames
  for (const EdgeObservation& o : observations) {
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

double PoseRefiner::pixelMotion(const SE3& a, const SE3& b) const {
  const double moved = (a.translation - b.translation).norm();
  const double turned = std::numbers::sqrt2 * angleBetween(a.rotation, b.rotation);
  return camera_.fx() / a.translation.z() * (moved + 0.35 * model_.diameter * turned);
}

}  // namespace diorama
