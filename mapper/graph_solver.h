// Least squares over a graph, or over its newest poses, by Ceres.
#pragma once

#include <string>

#include "mapper/graph.h"
#include "mapper/marginal_prior.h"

namespace diorama {

struct SolveResult {
  bool usable = false;  // else the graph is as it was
  int iterations = 0;
  double cost = 0;     // half the sum of squares after kernels
  std::string reason;  // why it is not usable
};

// Solves for the poses from `first` on and for all objects that they or the prior see; older poses
// enter through the prior, whose front is `first`. Without a prior `first` is 0: everything. The
// graph's very first pose is fixed. On one thread: the same input gives the same digits.
SolveResult solve(Graph& graph, size_t first, const MarginalPrior* prior, int max_iterations);

}  // namespace diorama
