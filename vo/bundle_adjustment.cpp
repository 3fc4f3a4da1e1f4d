#include "vo/bundle_adjustment.h"

#include <algorithm>

#include "vo/bundle_problem.h"

namespace diorama::vo {
namespace {

// Small: what is known least, the scale after a turn, has 1e-6 of the diagonal's information, and
// damping would leave it where it is.
constexpr double kLambdaFirst = 1e-8, kLambdaDown = 0.2, kLambdaUp = 20;
constexpr double kLambdaMin = 1e-10, kLambdaMax = 10;
constexpr double kSettled = 1e-3;  // relative decrease of the cost

}  // namespace

BundleReport adjustBundle(const Camera& camera, Map& map, const BundleRequest& request,
                          const VoOptions& options) {
  BundleProblem problem(camera, map, request, options);
  BundleReport report = problem.report();
  if (problem.empty()) return report;
  double cost = problem.cost(), lambda = kLambdaFirst;
  report.cost_before = cost;
  for (int i = 0; i < request.iterations && lambda < kLambdaMax; ++i) {
    problem.keep();
    const bool finite = problem.step(lambda);
    const double next = finite ? problem.cost() : cost;
    if (!finite || !(next < cost)) {
      problem.restore();
      lambda *= kLambdaUp;
      continue;
    }
    const bool settled = cost - next < kSettled * cost;
    cost = next;
    lambda = std::max(kLambdaMin, kLambdaDown * lambda);
    if (settled) break;
  }
  report.cost_after = cost;
  problem.keepCovariances();
  report.dropped = problem.dropOutliers();
  return report;
}

}  // namespace diorama::vo
