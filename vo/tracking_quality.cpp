#include "vo/tracking_quality.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace diorama::vo {
namespace {

constexpr double kFullShare =
    0.6;  // of the cells searched have a feature that agrees: as good as it gets
constexpr int kFewestTried = 20;  // cells: with less of the map in view, it says little
constexpr int kEnoughTried = 40;
constexpr double kLostShare =
    0.1;  // of that many: with fewer it is something before the lens that agrees
constexpr double kMemory = 0.1;  // weight of a new frame in the running mean
// Of the features found: from a wrong pose few are found, and few of these agree with any pose.
constexpr double kConvincingShare = 0.6;
constexpr double kRecoveryShare = 0.15;  // of the cells must agree after a loss, for many are tried
constexpr int kFewestPairs = 8;          // points in both frames, for a scale of their own
// Of residuals that no noise disturbs; features count as independent, which they are less then.
constexpr double kSmallestSigma = 0.5;
constexpr double kUnknownSigma = 1;  // m, rad: of directions that nothing holds

double healthOf(const ReprojectionResult& reprojected, const PoseRefinement& refined) {
  return std::min(
      1.0, refined.agreed_settled / (kFullShare * std::max(kFewestTried, reprojected.tried)));
}

bool isConvincing(const ReprojectionResult& reprojected, const PoseRefinement& refined) {
  return refined.agreed >= kConvincingShare * reprojected.matched;
}

Assessment bad(const std::string& reason) { return {false, 0, reason, Matrix6d::Zero(), {}}; }

Assessment good(const ReprojectionResult& reprojected, const PoseRefinement& refined) {
  std::vector<MapPoint*> failed = reprojected.missed;
  failed.insert(failed.end(), refined.disagreed.begin(), refined.disagreed.end());
  return {true, healthOf(reprojected, refined), "", refined.hessian, std::move(failed)};
}

}  // namespace

Assessment TrackingQuality::assess(const TrackedFrame& frame, const ReprojectionResult& reprojected,
                                   const PoseRefinement& refined) {
  const std::string agreed = std::to_string(refined.agreed);
  if (!refined.converged || refined.agreed < options_.min_features)
    return bad("only " + agreed + " features agree");
  if (refined.agreed < options_.lost_agreement * reprojected.matched)
    return bad("only " + agreed + " of " + std::to_string(reprojected.matched) +
               " features found agree");
  if (reprojected.tried >= kEnoughTried && refined.agreed_settled < kLostShare * reprojected.tried)
    return bad("only " + std::to_string(refined.agreed_settled) + " of " +
               std::to_string(reprojected.tried) + " known points agree");
  if (!frame.isFast() && refined.agreed < options_.lost_drop * usual_agreed_ &&
      !isConvincing(reprojected, refined))
    return bad("features dropped suddenly to " + agreed);
  usual_agreed_ = usual_agreed_ == 0 ? refined.agreed
                                     : usual_agreed_ + kMemory * (refined.agreed - usual_agreed_);
  return good(reprojected, refined);
}

Assessment TrackingQuality::assessRecovery(const ReprojectionResult& reprojected,
                                           const PoseRefinement& refined) {
  if (!refined.converged || refined.agreed < options_.min_features ||
      refined.agreed < kRecoveryShare * reprojected.tried || !isConvincing(reprojected, refined))
    return bad("no keyframe looks like it");
  usual_agreed_ = refined.agreed;
  return good(reprojected, refined);
}

Matrix6d stepCovariance(const TrackedFrame& before, const TrackedFrame& now,
                        const Matrix6d& hessian, const VoOptions& options) {
  std::unordered_map<const MapPoint*, Vector2d> residuals;
  for (const Feature& feature : before.features) residuals[feature.point] = feature.residual;
  std::vector<double> differences, absolute;
  for (const Feature& feature : now.features) {
    const int n = feature.isEdgelet() ? 1 : 2;
    for (int i = 0; i < n; ++i) absolute.push_back(std::abs(feature.residual[i]));
    if (const auto it = residuals.find(feature.point); it != residuals.end())
      for (int i = 0; i < n; ++i)
        differences.push_back(std::abs(feature.residual[i] - it->second[i]));
  }
  // Without common points both poses have their own error in the map.
  const bool common = differences.size() >= 2 * kFewestPairs;
  std::vector<double>& values = common ? differences : absolute;
  double sigma = kSmallestSigma;
  if (!values.empty()) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    sigma = std::max(sigma, *middle / 0.6745 * (common ? 1 : std::sqrt(2)));
  }
  sigma *= options.covariance_scale;
  const Matrix6d prior = Matrix6d::Identity() / (kUnknownSigma * kUnknownSigma);
  return (hessian / (sigma * sigma) + prior).inverse();
}

}  // namespace diorama::vo
