#include "eval/object_errors.h"

#include <algorithm>
#include <numbers>

#include "eval/statistics.h"

namespace diorama {
namespace {

constexpr double kVisible = 0.4;     // least visible_fraction of success_visible_*
constexpr double kAucLimit_m = 0.1;  // where the ADD curve ends
constexpr double kDegree = std::numbers::pi / 180;

struct Bound {
  double translation_m, rotation_rad;
  bool holds(const PoseError& error) const {
    return error.translation_m <= translation_m && error.rotation_rad <= rotation_rad;
  }
};
constexpr Bound k5cm5deg{0.05, 5 * kDegree};
constexpr Bound k1cm1deg{0.01, 1 * kDegree};

std::optional<double> mean(const std::vector<double>& values) {
  const std::optional<Statistics> statistics = summarise(values);
  if (!statistics) return std::nullopt;
  return statistics->mean;
}

// Half the model's size: turns an angle into a distance on its surface.
double leverOf(const ObjectModel& model) {
  if (model.mesh.positions.empty()) return 0.1;
  return std::max(0.5 * model.mesh.diameter(), 1e-6);
}

}  // namespace

ObjectEvaluation::ObjectEvaluation(const ObjectModel& model)
    : model_(model), lever_m_(leverOf(model)), distance_(model) {}

void ObjectEvaluation::Ratio::add(bool hit) {
  hits += hit;
  ++total;
}

std::optional<double> ObjectEvaluation::Ratio::value() const {
  if (total == 0) return std::nullopt;
  return static_cast<double>(hits) / total;
}

void ObjectEvaluation::add(const ObjectFrame& frame) {
  reported_.add(frame.reported.has_value());
  claimed_.add(frame.claimed);
  if (!frame.truth) return;
  addReported(frame);
  if (frame.claimed && frame.raw) addClaimed(frame);
}

ObjectMetrics ObjectEvaluation::metrics() const {
  ObjectMetrics m;
  if (const auto translation = summarise(translations_)) {
    m.mean_error_m = translation->mean;
    m.std_error_m = translation->std;
    m.median_error_m = translation->median;
  }
  m.mean_error_rad = mean(rotations_);
  m.ratio_below_0_5_m = near_.value();
  m.success_5cm_5deg = success_5_.value();
  m.success_1cm_1deg = success_1_.value();
  m.success_visible_5cm_5deg = visible_5_.value();
  m.success_visible_1cm_1deg = visible_1_.value();
  m.add_auc_10cm = mean(add_scores_);
  m.reported_ratio = reported_.value();
  m.claimed_ratio = claimed_.value();
  m.false_claim_ratio = false_claims_.value();
  m.tracker_nees = mean(nees_);
  return m;
}

SE3 ObjectEvaluation::nearest(const SE3& estimate, const SE3& truth) const {
  return nearestSymmetricPose(estimate, truth, model_.symmetries, lever_m_);
}

void ObjectEvaluation::addReported(const ObjectFrame& frame) {
  std::optional<PoseError> error;
  if (frame.reported && frame.reported->isFinite())
    error = poseError(*frame.reported, nearest(*frame.reported, *frame.truth));
  const bool near = error && error->translation_m < kFar_m;
  near_.add(near);
  if (near) {
    translations_.push_back(error->translation_m);
    rotations_.push_back(error->rotation_rad);
  }
  const bool within_5 = error && k5cm5deg.holds(*error), within_1 = error && k1cm1deg.holds(*error);
  success_5_.add(within_5);
  success_1_.add(within_1);
  if (frame.visible_fraction.value_or(0) >= kVisible) {
    visible_5_.add(within_5);
    visible_1_.add(within_1);
  }
  addDistance(frame, error.has_value());
}

// The area under the share of frames below a threshold, for thresholds from 0 to the limit,
// over the limit: each frame adds 1 - ADD / limit.
void ObjectEvaluation::addDistance(const ObjectFrame& frame, bool reported) {
  if (model_.mesh.positions.empty()) return;
  const double add = reported ? distance_(*frame.reported, *frame.truth).value() : kAucLimit_m;
  add_scores_.push_back(std::max(0.0, 1 - add / kAucLimit_m));
}

void ObjectEvaluation::addClaimed(const ObjectFrame& frame) {
  if (!frame.raw->isFinite()) {
    false_claims_.add(true);
    return;
  }
  const SE3 truth = nearest(*frame.raw, *frame.truth);
  false_claims_.add(!k5cm5deg.holds(poseError(*frame.raw, truth)));
  if (!frame.raw_covariance) return;
  const std::optional<double> nees = normalisedError(*frame.raw, *frame.raw_covariance, truth);
  if (nees) nees_.push_back(*nees);
}

void evaluateMap(const ObjectEstimate& estimate, const SE3& T_start_object,
                 const Symmetries& symmetries, ObjectMetrics& metrics) {
  if (!estimate.T_world_object.isFinite()) return;
  const SE3 truth = nearestSymmetricPose(estimate.T_world_object, T_start_object, symmetries);
  const PoseError error = poseError(estimate.T_world_object, truth);
  metrics.map_error_m = error.translation_m;
  metrics.map_error_rad = error.rotation_rad;
  metrics.map_nees = normalisedError(estimate.T_world_object, estimate.covariance, truth);
}

}  // namespace diorama
