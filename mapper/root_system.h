// The root of the smoother: what all measurements so far say about the newest camera pose and the
// objects in use, as the quadratic
//   1/2 delta^T A delta - b^T delta,   delta = [camera, object slots...],
// where each delta is Log(X^-1 T) of a variable T in its chart X. Poses are eliminated in the order
// of time and the objects last, so that its size depends on the objects only. What is eliminated
// leaves a clique behind. This is the root of a Bayes tree (Kaess et al. 2012, iSAM2) with an order
// of variables that is made for few objects and many poses.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "mapper/relative_pose.h"

namespace diorama {

using ObjectSlots = std::vector<size_t>;  // numbers of the objects behind the camera's block

// A variable that was eliminated: delta = d - S delta_separator. In single precision, since there
// is one per pose: its rounding is relative to deltas, which go to zero as everything is linearised
// where it stands.
struct Clique {
  Eigen::Matrix<float, 6, Eigen::Dynamic> S;  // by a camera pose, then by the objects of `slots`
  Eigen::Matrix<float, 6, 1> d;
  std::shared_ptr<const ObjectSlots> slots;
};

// A linearised residual between two variables, r + J_a delta_a + J_b delta_b, both in their charts.
struct ChartPair {
  Vector6d r;
  Matrix6d J_a, J_b;
};

// Between two poses, and maybe a scale: a variable among the objects, of which the first number
// counts.
struct ChartStep : ChartPair {
  std::optional<size_t> scale = {};
  Vector6d J_scale = Vector6d::Zero();
};

// From a residual linearised where its variables stand, T Exp(eps) with T = X Exp(delta0): in the
// chart eps = Jr(delta0) (delta - delta0) to first order.
ChartPair inCharts(const LinearisedPair& pair, const Vector6d& delta_a, const Vector6d& delta_b);

// Blocks with long columns, for what is done once per measurement.
using Columns6d = Eigen::Matrix<double, Eigen::Dynamic, 6>;
void divideByTranspose(Columns6d& B, const Matrix6d& L);      // B <- B L^-T, L lower triangular
void divide(Columns6d& B, const Matrix6d& L);                 // B <- B L^-1
void subtractSquare(Eigen::MatrixXd& A, const Columns6d& B);  // A <- A - B B^T

class RootSystem {
 public:
  // The camera's block belongs to the first pose of a graph, which is fixed: residuals at it must
  // come without their J_a.
  RootSystem();

  const ObjectSlots& slots() const { return *slots_; }
  bool holds(size_t object) const;
  // Where an object's block begins; it must be held.
  Eigen::Index position(size_t object) const;
  Eigen::Index size() const { return b_.size(); }

  void addObject(size_t object);  // nothing is known about it yet

  // A residual between the camera and an object that is held.
  void absorb(const ChartPair& pair, size_t object);

  // Absorbs a residual between the camera and the next pose, eliminates the camera and puts the
  // next pose in its place. A scale must be held.
  Clique advance(const ChartStep& odometry);

  // Eliminates an object; its separator is the camera and the remaining objects.
  Clique eliminate(size_t object);

  // The minimum and the covariance, finite always: where rounding has made A singular, directions
  // are held at 1e-12 of the largest information.
  struct Solution {
    Eigen::VectorXd delta;
    Eigen::MatrixXd P;
  };
  Solution solve() const;

 private:
  void absorbScale(const ChartStep& odometry);

  Eigen::MatrixXd A_;  // symmetric, both halves
  Eigen::VectorXd b_;
  std::shared_ptr<const ObjectSlots> slots_;
};

}  // namespace diorama
