// What the poses before one pose, the front, say about the front and the objects: the quadratic
//   1/2 delta^T A delta - b^T delta,  delta = [Log(X^-1 T_front), Log(L_j^-1 T_object_j), ...],
// with X, L_j the charts, where each variable was linearised first. Eliminating poses in time with
// the objects last keeps it small: its size depends on the objects only.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "mapper/graph.h"

namespace diorama {

class MarginalPrior {
 public:
  // The gauge: the front is the first pose of a graph, which is fixed.
  explicit MarginalPrior(const SE3& T_world_first);

  // Absorbs what the front pose sees, linearised at the graph's current values; objects that are
  // new to the prior get their chart there.
  void absorbObjects(const Graph& graph, size_t front);

  // Absorbs the odometry from the front to the next pose and eliminates the front (a Schur
  // complement); the next pose is the front then.
  void advance(const Graph& graph, size_t front);

  // Joint covariance of the front and the objects of slots(), in the right tangents of the graph's
  // current values. Always finite and positive definite: where rounding has made the information
  // singular, the unknown directions get a variance of 1e12 times the smallest one.
  Eigen::MatrixXd covariance(const Graph& graph, size_t front) const;

  // Objects that the prior knows, in the order of their blocks behind the front's.
  const std::vector<size_t>& slots() const { return slots_; }

  // How far a variable has moved from its chart: largest translation (m) and rotation (rad).
  struct Moved {
    double translation_m = 0, rotation_rad = 0;
  };
  Moved moved(const Graph& graph, size_t front) const;

  // The same as a factor: |R delta - R^-T b|^2 with R^T R = A, on the blocks of the front and the
  // objects of slots().
  std::unique_ptr<ceres::CostFunction> makeCost() const;

 private:
  struct Term {  // a block's position in A, and where its variable stands in its chart
    Eigen::Index at;
    Vector6d delta;
  };
  void absorb(const LinearisedPair& pair, const Term& a, const Term& b);
  Term objectTerm(const Graph& graph, size_t object);

  SE3 front_chart_;
  std::vector<SE3> object_charts_;
  std::vector<size_t> slots_;
  Eigen::MatrixXd A_;
  Eigen::VectorXd b_;
};

}  // namespace diorama
