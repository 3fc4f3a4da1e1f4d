// The prior against dense least squares and Ceres.
#include "mapper/marginal_prior.h"

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include "mapper/graph_solver.h"
#include "mapper/se3_manifold.h"
#include "tests/mapper/synthetic_graph.h"

namespace diorama {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)

// The graph of a synthetic sequence, its variables placed by the measurements.
Graph toGraph(const SyntheticGraph& synthetic) {
  Graph graph;
  graph.object_kernel = {RobustKernel::Kind::kCauchyTail, 4.1};
  for (size_t k = 0; k < synthetic.truth.poses.size(); ++k) {
    PoseNode pose{synthetic.truth.poses[k].timestamp_ns, SE3{}, {}};
    if (k > 0) {
      graph.odometry.push_back(*makeOdometryFactor(synthetic.odometry[k - 1], 1).factor);
      pose.T_world_camera = graph.poses.back().T_world_camera * graph.odometry.back().Z;
    }
    for (const ObjectMeasurement& m : synthetic.observations[k]) {
      size_t object = 0;
      while (object < graph.objects.size() && graph.objects[object].name != m.object) ++object;
      if (object == graph.objects.size())
        graph.objects.push_back({m.object, pose.T_world_camera * m.T_camera_object});
      pose.objects.push_back(*makeObjectFactor(m, object, 1).factor);
    }
    graph.poses.push_back(pose);
  }
  return graph;
}

MarginalPrior marchTo(const Graph& graph, size_t front) {
  MarginalPrior prior(graph.poses.front().T_world_camera);
  for (size_t k = 0; k < front; ++k) {
    prior.absorbObjects(graph, k);
    prior.advance(graph, k);
  }
  return prior;
}

// ceres::Covariance of the newest pose and the objects at the same linearisation point. The kernel
// is left out of the comparison: Ceres adds its curvature, which reweighting does not have.
TEST(MarginalPrior, CovarianceEqualsThatOfCeres) {
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    Graph graph = toGraph(makeGraph({.poses = 40, .objects = 3, .visible = 0.5}, seed));
    graph.object_kernel = {};
    ASSERT_TRUE(solve(graph, 0, nullptr, 50).usable);
    const size_t last = graph.poses.size() - 1;
    MarginalPrior root = marchTo(graph, last);
    root.absorbObjects(graph, last);
    const Eigen::MatrixXd P = root.covariance(graph, last);

    std::vector<PoseBlock> poses, objects;
    for (const PoseNode& pose : graph.poses) poses.push_back(toBlock(pose.T_world_camera));
    for (const ObjectNode& object : graph.objects)
      objects.push_back(toBlock(object.T_world_object));
    ceres::Problem problem;
    const auto add = [&](PoseBlock& block) {
      problem.AddParameterBlock(block.data(), 7, makeSE3Manifold().release());
    };
    for (PoseBlock& block : poses) add(block);
    for (PoseBlock& block : objects) add(block);
    problem.SetParameterBlockConstant(poses[0].data());
    for (size_t k = 0; k < poses.size(); ++k) {
      for (const ObjectFactor& factor : graph.poses[k].objects)
        problem.AddResidualBlock(makeCost(factor).release(), nullptr, poses[k].data(),
                                 objects[factor.object].data());
      if (k < last)
        problem.AddResidualBlock(makeCost(graph.odometry[k]).release(), nullptr, poses[k].data(),
                                 poses[k + 1].data());
    }
    ceres::Covariance::Options options;
    options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
    options.algorithm_type = ceres::SPARSE_QR;
    ceres::Covariance covariance(options);
    std::vector<const double*> blocks{poses[last].data()};
    for (size_t slot : root.slots()) blocks.push_back(objects[slot].data());
    ASSERT_TRUE(covariance.Compute(blocks, &problem));
    for (size_t i = 0; i < blocks.size(); ++i) {
      for (size_t j = 0; j < blocks.size(); ++j) {
        Eigen::Matrix<double, 6, 6, Eigen::RowMajor> expected;
        ASSERT_TRUE(
            covariance.GetCovarianceBlockInTangentSpace(blocks[i], blocks[j], expected.data()));
        const Matrix6d block = P.block<6, 6>(6 * static_cast<int>(i), 6 * static_cast<int>(j));
        EXPECT_THAT(block, MatrixNear(Matrix6d(expected), 1e-6 * P.diagonal().maxCoeff()));
      }
    }
  }
}

// At the optimum, where the prior is exact, solving for the newest poses changes nothing.
TEST(MarginalPrior, WindowKeepsTheOptimum) {
  for (size_t first : {1u, 10u, 38u}) {
    Graph graph = toGraph(makeGraph({.poses = 40, .objects = 2, .visible = 0.6}, 3));
    ASSERT_TRUE(solve(graph, 0, nullptr, 100).usable);
    const Graph optimum = graph;
    const MarginalPrior prior = marchTo(graph, first);
    EXPECT_LT(prior.moved(graph, first).translation_m, 1e-12);
    // Start elsewhere.
    Numbers numbers(1);
    for (size_t k = first; k < graph.poses.size(); ++k)
      graph.poses[k].T_world_camera =
          graph.poses[k].T_world_camera * exp(Vector6d(1e-3 * numbers.normal6()));
    ASSERT_TRUE(solve(graph, first, &prior, 100).usable);
    for (size_t k = first; k < graph.poses.size(); ++k)
      EXPECT_THAT(graph.poses[k].T_world_camera,
                  PoseNear(optimum.poses[k].T_world_camera, 1e-5, 1e-5));
    for (size_t j = 0; j < graph.objects.size(); ++j)
      EXPECT_THAT(graph.objects[j].T_world_object,
                  PoseNear(optimum.objects[j].T_world_object, 1e-5, 1e-5));
  }
}

TEST(MarginalPrior, CostJacobianMatchesNumericOne) {
  Graph graph = toGraph(makeGraph({.poses = 20, .objects = 2}, 4));
  const MarginalPrior prior = marchTo(graph, 10);
  const auto cost = prior.makeCost();
  ASSERT_EQ(cost->parameter_block_sizes().size(), 3u);
  ASSERT_EQ(cost->num_residuals(), 18);
  Numbers numbers(5);
  std::vector<SE3> values{graph.poses[10].T_world_camera};
  for (size_t slot : prior.slots()) values.push_back(graph.objects[slot].T_world_object);
  for (SE3& value : values) value = value * exp(Vector6d(0.3 * numbers.normal6()));
  const auto residuals = [&](const std::vector<SE3>& at, double** jacobians) {
    std::vector<PoseBlock> blocks;
    for (const SE3& value : at) blocks.push_back(toBlock(value));
    const double* pointers[] = {blocks[0].data(), blocks[1].data(), blocks[2].data()};
    Eigen::VectorXd r(18);
    EXPECT_TRUE(cost->Evaluate(pointers, r.data(), jacobians));
    return r;
  };
  Eigen::Matrix<double, 18, 7, Eigen::RowMajor> J[3];
  double* pointers[] = {J[0].data(), J[1].data(), J[2].data()};
  residuals(values, pointers);
  for (size_t i = 0; i < 3; ++i) {
    const Eigen::MatrixXd numeric = numericPoseJacobian(
        [&](const SE3& T) {
          std::vector<SE3> moved = values;
          moved[i] = T;
          return residuals(moved, nullptr);
        },
        values[i]);
    EXPECT_THAT(J[i] * blockByTangent(values[i]),
                MatrixNear(numeric, 1e-7 * numeric.cwiseAbs().maxCoeff()));
  }
}

// Nothing but a gauge and no odometry to speak of: still finite.
TEST(MarginalPrior, CovarianceIsFiniteWithoutInformation) {
  Graph graph;
  graph.poses.resize(3);
  graph.poses[1].timestamp_ns = 1;
  graph.poses[2].timestamp_ns = 2;
  graph.odometry.assign(2, makeGapFactor(1e6, 1, 1));
  const MarginalPrior prior = marchTo(graph, 2);
  const Eigen::MatrixXd P = prior.covariance(graph, 2);
  EXPECT_TRUE(P.allFinite());
  EXPECT_GT(P(0, 0), 1e11);
}

}  // namespace
}  // namespace diorama
