// Least squares over a whole graph by Ceres: the final polish, and what the smoother is tested
// against.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "mapper/graph.h"

namespace diorama {

struct SolveResult {
  bool usable = false;  // else the graph is as it was
  int iterations = 0;
  double cost = 0;     // half the sum of squares after kernels
  std::string reason;  // why it is not usable
};

// Solves for all poses and objects; the first pose is fixed. On one thread: the same input gives
// the same digits.
SolveResult solve(Graph& graph, int max_iterations);

// Covariance of the newest pose and the objects in `objects`, in right tangents and in that order,
// by ceres::Covariance at the graph's present values and without kernels (Ceres adds their
// curvature, which reweighting does not have). Nothing when it is singular.
std::optional<Eigen::MatrixXd> jointCovariance(const Graph& graph,
                                               const std::vector<size_t>& objects);

// Half the sum of squares after kernels.
double cost(const Graph& graph);

}  // namespace diorama
