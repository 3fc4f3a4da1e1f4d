#include "mapper/graph_solver.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>

#include "core/errors.h"
#include "mapper/se3_manifold.h"

namespace diorama {
namespace {

// A graph as Ceres holds it.
class GraphProblem {
 public:
  explicit GraphProblem(const Graph& graph)
      : manifold_(makeSE3Manifold()),
        object_loss_(makeLoss(graph.object_kernel)),
        odometry_loss_(makeLoss(graph.odometry_kernel)),
        problem_(problemOptions()) {
    for (const PoseNode& pose : graph.poses) poses_.push_back(toBlock(pose.T_world_camera));
    for (const ObjectNode& object : graph.objects)
      objects_.push_back(toBlock(object.T_world_object));
    for (PoseBlock& block : poses_) addBlock(block);
    problem_.SetParameterBlockConstant(poses_.front().data());
    addFactors(graph);
  }

  ceres::Problem& problem() { return problem_; }
  const double* newestPose() const { return poses_.back().data(); }
  const double* object(size_t j) const { return objects_[j].data(); }

  bool isFinite() const {
    const auto finite = [](const PoseBlock& block) {
      return std::all_of(block.begin(), block.end(), [](double v) { return std::isfinite(v); });
    };
    return std::all_of(poses_.begin(), poses_.end(), finite) &&
           std::all_of(objects_.begin(), objects_.end(), finite);
  }

  void copyTo(Graph& graph) const {
    for (size_t i = 0; i < poses_.size(); ++i)
      graph.poses[i].T_world_camera = fromBlock(poses_[i].data());
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
      for (const ObjectFactor& factor : graph.poses[i].objects) {
        PoseBlock& object = objects_[factor.object];
        addBlock(object);
        problem_.AddResidualBlock(makeCost(factor).release(), object_loss_.get(),
                                  factor.prior ? origin() : camera, object.data());
      }
      if (i + 1 < poses_.size()) addStep(graph.odometry[i], camera, poses_[i + 1].data());
    }
  }

  void addStep(const OdometryFactor& factor, double* from, double* to) {
    std::vector<double*> blocks{from, to};
    if (factor.scale) blocks.push_back(objects_[*factor.scale].data());
    problem_.AddResidualBlock(makeCost(factor).release(), odometry_loss_.get(), blocks);
  }

  // What priors are seen from.
  double* origin() {
    addBlock(origin_);
    problem_.SetParameterBlockConstant(origin_.data());
    return origin_.data();
  }

  PoseBlock origin_ = toBlock(SE3{});
  std::vector<PoseBlock> poses_, objects_;
  std::unique_ptr<ceres::Manifold> manifold_;
  std::unique_ptr<ceres::LossFunction> object_loss_, odometry_loss_;
  ceres::Problem problem_;
};

SE3 scaledStep(const Graph& graph, size_t k) {
  const OdometryFactor& step = graph.odometry[k];
  if (!step.scale) return step.Z;
  return scaled(step.Z, graph.objects[*step.scale].T_world_object.translation.x());
}

}  // namespace

SolveResult solve(Graph& graph, int max_iterations) {
  DIORAMA_CHECK(!graph.poses.empty());
  GraphProblem problem(graph);
  ceres::Solver::Options options;
  options.max_num_iterations = max_iterations;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  // Eigen's factorisation, since the other ones call a BLAS with threads of its own.
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  options.function_tolerance = 1e-12;
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

std::optional<Eigen::MatrixXd> jointCovariance(const Graph& graph,
                                               const std::vector<size_t>& objects) {
  Graph plain = graph;
  plain.object_kernel = plain.odometry_kernel = {};
  GraphProblem problem(plain);
  ceres::Covariance::Options options;
  options.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
  options.algorithm_type = ceres::SPARSE_QR;
  options.num_threads = 1;
  ceres::Covariance covariance(options);
  std::vector<const double*> blocks{problem.newestPose()};
  for (size_t j : objects) blocks.push_back(problem.object(j));
  if (!covariance.Compute(blocks, &problem.problem())) return std::nullopt;
  const auto size = static_cast<Eigen::Index>(6 * blocks.size());
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> P(size, size);
  if (!covariance.GetCovarianceMatrixInTangentSpace(blocks, P.data())) return std::nullopt;
  return P;
}

double cost(const Graph& graph) {
  double sum = 0;
  const auto add = [&](const SE3& Z, const Whitening& W, const RobustKernel& kernel, const SE3& a,
                       const SE3& b) {
    sum += 0.5 * kernel((W.matrix() * log(Z.inverse() * (a.inverse() * b))).squaredNorm()).rho;
  };
  for (size_t k = 0; k < graph.poses.size(); ++k) {
    const PoseNode& pose = graph.poses[k];
    for (const ObjectFactor& factor : pose.objects)
      add(factor.Z, factor.W, graph.object_kernel, factor.prior ? SE3{} : pose.T_world_camera,
          graph.objects[factor.object].T_world_object);
    if (k + 1 < graph.poses.size())
      add(scaledStep(graph, k), graph.odometry[k].W, graph.odometry_kernel, pose.T_world_camera,
          graph.poses[k + 1].T_world_camera);
  }
  return sum;
}

}  // namespace diorama
