#include "mapper/graph_solver.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>

#include "core/errors.h"
#include "mapper/se3_manifold.h"

namespace diorama {
namespace {

// The part of a graph that is solved for, as Ceres holds it.
class GraphProblem {
 public:
  GraphProblem(const Graph& graph, size_t first, const MarginalPrior* prior)
      : first_(first),
        manifold_(makeSE3Manifold()),
        loss_(makeLoss(graph.object_kernel)),
        problem_(problemOptions()) {
    for (size_t k = first; k < graph.poses.size(); ++k)
      poses_.push_back(toBlock(graph.poses[k].T_world_camera));
    for (const ObjectNode& object : graph.objects)
      objects_.push_back(toBlock(object.T_world_object));
    for (PoseBlock& block : poses_) addBlock(block);
    if (first == 0) problem_.SetParameterBlockConstant(poses_.front().data());
    addFactors(graph);
    if (prior) addPrior(*prior);
  }

  ceres::Problem& problem() { return problem_; }

  bool isFinite() const {
    const auto finite = [](const PoseBlock& block) {
      return std::all_of(block.begin(), block.end(), [](double v) { return std::isfinite(v); });
    };
    return std::all_of(poses_.begin(), poses_.end(), finite) &&
           std::all_of(objects_.begin(), objects_.end(), finite);
  }

  void copyTo(Graph& graph) const {
    for (size_t i = 0; i < poses_.size(); ++i)
      graph.poses[first_ + i].T_world_camera = fromBlock(poses_[i].data());
    for (size_t j = 0; j < objects_.size(); ++j)
      graph.objects[j].T_world_object = fromBlock(objects_[j].data());
  }

 private:
  static ceres::Problem::Options problemOptions() {
    ceres::Problem::Options options;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    return options;
  }

  void addBlock(PoseBlock& block) {
    if (!problem_.HasParameterBlock(block.data()))
      problem_.AddParameterBlock(block.data(), 7, manifold_.get());
  }

  void addFactors(const Graph& graph) {
    for (size_t i = 0; i < poses_.size(); ++i) {
      double* camera = poses_[i].data();
      for (const ObjectFactor& factor : graph.poses[first_ + i].objects) {
        PoseBlock& object = objects_[factor.object];
        addBlock(object);
        problem_.AddResidualBlock(makeCost(factor).release(), loss_.get(), camera, object.data());
      }
      if (i + 1 < poses_.size())
        problem_.AddResidualBlock(makeCost(graph.odometry[first_ + i]).release(), nullptr, camera,
                                  poses_[i + 1].data());
    }
  }

  void addPrior(const MarginalPrior& prior) {
    std::vector<double*> blocks{poses_.front().data()};
    for (size_t object : prior.slots()) {
      addBlock(objects_[object]);
      blocks.push_back(objects_[object].data());
    }
    problem_.AddResidualBlock(prior.makeCost().release(), nullptr, blocks);
  }

  size_t first_;
  std::vector<PoseBlock> poses_, objects_;
  std::unique_ptr<ceres::Manifold> manifold_;
  std::unique_ptr<ceres::LossFunction> loss_;
  ceres::Problem problem_;
};

}  // namespace

SolveResult solve(Graph& graph, size_t first, const MarginalPrior* prior, int max_iterations) {
  DIORAMA_CHECK(first < graph.poses.size() && (prior || first == 0));
  GraphProblem problem(graph, first, prior);
  ceres::Solver::Options options;
  options.max_num_iterations = max_iterations;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  // Eigen's factorisation, since the other ones call a BLAS with threads of its own.
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  // An update is followed by the next one, which goes on where it stopped.
  options.function_tolerance = prior ? 1e-8 : 1e-12;
  options.parameter_tolerance = 1e-11;
  options.gradient_tolerance = 1e-12;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem.problem(), &summary);
  SolveResult result;
  result.iterations = static_cast<int>(summary.iterations.size());
  result.cost = summary.final_cost;
  if (!summary.IsSolutionUsable()) {
    result.reason = summary.message;
  } else if (!problem.isFinite() || !std::isfinite(result.cost)) {
    result.reason = "the solution is not finite";
  } else {
    result.usable = true;
    problem.copyTo(graph);
  }
  return result;
}

}  // namespace diorama
