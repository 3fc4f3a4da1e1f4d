#include "mapper/marginal_prior.h"

#include <ceres/cost_function.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>

#include "mapper/se3_manifold.h"

namespace diorama {
namespace {

// The first pose is fixed by this standard deviation (m, rad); small against any measurement.
constexpr double kGaugeSigma = 1e-7;

class MarginalPriorCost final : public ceres::CostFunction {
 public:
  MarginalPriorCost(std::vector<SE3> charts, Eigen::MatrixXd R, Eigen::VectorXd d)
      : charts_(std::move(charts)), R_(std::move(R)), d_(std::move(d)) {
    set_num_residuals(static_cast<int>(R_.rows()));
    mutable_parameter_block_sizes()->assign(charts_.size(), 7);
  }

  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    Eigen::VectorXd delta(R_.cols());
    for (size_t i = 0; i < charts_.size(); ++i) {
      const SE3 value = fromBlock(blocks[i]);
      const Eigen::Index at = 6 * static_cast<Eigen::Index>(i);
      const Vector6d local = log(charts_[i].inverse() * value);
      delta.segment<6>(at) = local;
      if (!jacobians || !jacobians[i]) continue;
      // Log(X^-1 T Exp(xi)) ~ delta + Jr^-1(delta) xi
      using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, 7, Eigen::RowMajor>;
      Eigen::Map<Jacobian>(jacobians[i], R_.rows(), 7) =
          R_.middleCols<6>(at) * (rightJacobianInverse(local) * tangentByBlock(value));
    }
    Eigen::Map<Eigen::VectorXd>(residuals, R_.rows()) = R_ * delta - d_;
    return true;
  }

 private:
  std::vector<SE3> charts_;
  Eigen::MatrixXd R_;
  Eigen::VectorXd d_;
};

// Of a positive definite matrix; of one that is nearly so, with its eigenvalues raised.
Eigen::MatrixXd inverse(const Eigen::MatrixXd& A) {
  const Eigen::LLT<Eigen::MatrixXd> llt(A);
  if (llt.info() == Eigen::Success) {
    Eigen::MatrixXd P = llt.solve(Eigen::MatrixXd::Identity(A.rows(), A.cols()));
    if (P.allFinite()) return P;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(A);
  const Eigen::VectorXd values =
      eigen.eigenvalues().cwiseMax(1e-12 * eigen.eigenvalues().maxCoeff());
  return eigen.eigenvectors() * values.cwiseInverse().asDiagonal() *
         eigen.eigenvectors().transpose();
}

Vector6d inChart(const SE3& chart, const SE3& value) { return log(chart.inverse() * value); }

}  // namespace

MarginalPrior::MarginalPrior(const SE3& T_world_first)
    : front_chart_(T_world_first),
      A_(Matrix6d::Identity() / (kGaugeSigma * kGaugeSigma)),
      b_(Vector6d::Zero()) {}

// The pair is linearised where the variables stand, T Exp(eps) with T = X Exp(delta0). In the chart
// eps = Jr(delta0) (delta - delta0) to first order.
void MarginalPrior::absorb(const LinearisedPair& pair, const Term& a, const Term& b) {
  const Matrix6d J_a = pair.J_a * rightJacobian(a.delta), J_b = pair.J_b * rightJacobian(b.delta);
  const Vector6d r = pair.r - J_a * a.delta - J_b * b.delta;
  A_.block<6, 6>(a.at, a.at) += J_a.transpose() * J_a;
  A_.block<6, 6>(b.at, b.at) += J_b.transpose() * J_b;
  const Matrix6d cross = J_a.transpose() * J_b;
  A_.block<6, 6>(a.at, b.at) += cross;
  A_.block<6, 6>(b.at, a.at) += cross.transpose();
  b_.segment<6>(a.at) -= J_a.transpose() * r;
  b_.segment<6>(b.at) -= J_b.transpose() * r;
}

MarginalPrior::Term MarginalPrior::objectTerm(const Graph& graph, size_t object) {
  const SE3& value = graph.objects[object].T_world_object;
  const auto found = std::find(slots_.begin(), slots_.end(), object);
  const auto slot = found - slots_.begin();
  if (found != slots_.end())
    return {6 + 6 * slot, inChart(object_charts_[static_cast<size_t>(slot)], value)};
  slots_.push_back(object);
  object_charts_.push_back(value);
  const Eigen::Index at = A_.rows();
  A_.conservativeResizeLike(Eigen::MatrixXd::Zero(at + 6, at + 6));
  b_.conservativeResizeLike(Eigen::VectorXd::Zero(at + 6));
  return {at, Vector6d::Zero()};
}

void MarginalPrior::absorbObjects(const Graph& graph, size_t front) {
  const PoseNode& pose = graph.poses[front];
  const Term camera{0, inChart(front_chart_, pose.T_world_camera)};
  for (const ObjectFactor& factor : pose.objects)
    absorb(linearise(factor, graph.object_kernel, pose.T_world_camera,
                     graph.objects[factor.object].T_world_object),
           camera, objectTerm(graph, factor.object));
}

void MarginalPrior::advance(const Graph& graph, size_t front) {
  const SE3& T_front = graph.poses[front].T_world_camera;
  const SE3& T_next = graph.poses[front + 1].T_world_camera;
  // Room for the next pose behind the objects.
  const Eigen::Index size = A_.rows(), objects = size - 6;
  A_.conservativeResizeLike(Eigen::MatrixXd::Zero(size + 6, size + 6));
  b_.conservativeResizeLike(Eigen::VectorXd::Zero(size + 6));
  absorb(linearise(graph.odometry[front], T_front, T_next), {0, inChart(front_chart_, T_front)},
         {size, Vector6d::Zero()});
  // A <- A22 - A21 A11^-1 A12 by A11 = L L^T, S = L^-1 A12.
  const Eigen::LLT<Matrix6d> llt(Matrix6d(A_.topLeftCorner<6, 6>()));
  const Eigen::MatrixXd S = llt.matrixL().solve(A_.topRightCorner(6, size));
  const Vector6d d = llt.matrixL().solve(b_.head<6>());
  const Eigen::MatrixXd schur = A_.bottomRightCorner(size, size) - S.transpose() * S;
  const Eigen::VectorXd rest = b_.tail(size) - S.transpose() * d;
  // The next pose comes first again.
  A_.resize(size, size);
  A_ << schur.bottomRightCorner<6, 6>(), schur.bottomLeftCorner(6, objects),
      schur.topRightCorner(objects, 6), schur.topLeftCorner(objects, objects);
  b_.resize(size);
  b_ << rest.tail<6>(), rest.head(objects);
  front_chart_ = T_next;
}

Eigen::MatrixXd MarginalPrior::covariance(const Graph& graph, size_t front) const {
  Eigen::MatrixXd P = inverse(A_);
  const auto toCurrent = [&](Eigen::Index at, const SE3& chart, const SE3& value) {
    const Matrix6d J = rightJacobian(inChart(chart, value));
    P.middleRows<6>(at) = (J * P.middleRows<6>(at)).eval();
    P.middleCols<6>(at) = (P.middleCols<6>(at) * J.transpose()).eval();
  };
  toCurrent(0, front_chart_, graph.poses[front].T_world_camera);
  for (size_t i = 0; i < slots_.size(); ++i)
    toCurrent(6 + 6 * static_cast<Eigen::Index>(i), object_charts_[i],
              graph.objects[slots_[i]].T_world_object);
  return 0.5 * (P + P.transpose());
}

MarginalPrior::Moved MarginalPrior::moved(const Graph& graph, size_t front) const {
  Moved most;
  const auto consider = [&](const SE3& chart, const SE3& value) {
    const Vector6d delta = inChart(chart, value);
    most.translation_m = std::max(most.translation_m, delta.head<3>().norm());
    most.rotation_rad = std::max(most.rotation_rad, delta.tail<3>().norm());
  };
  consider(front_chart_, graph.poses[front].T_world_camera);
  for (size_t i = 0; i < slots_.size(); ++i)
    consider(object_charts_[i], graph.objects[slots_[i]].T_world_object);
  return most;
}

std::unique_ptr<ceres::CostFunction> MarginalPrior::makeCost() const {
  std::vector<SE3> charts{front_chart_};
  charts.insert(charts.end(), object_charts_.begin(), object_charts_.end());
  const Eigen::LLT<Eigen::MatrixXd> llt(A_);
  if (llt.info() == Eigen::Success)
    return std::make_unique<MarginalPriorCost>(std::move(charts), llt.matrixU(),
                                               llt.matrixL().solve(b_));
  // Singular by rounding: leave out the directions that the prior knows nothing about.
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(A_);
  const Eigen::VectorXd values = eigen.eigenvalues();
  const double floor = 1e-15 * values.maxCoeff();
  const Eigen::VectorXd roots = (values.array() > floor).select(values.cwiseMax(0).cwiseSqrt(), 0);
  const Eigen::VectorXd inverse = (values.array() > floor).select(roots.cwiseInverse(), 0);
  return std::make_unique<MarginalPriorCost>(
      std::move(charts), roots.asDiagonal() * eigen.eigenvectors().transpose(),
      inverse.asDiagonal() * (eigen.eigenvectors().transpose() * b_));
}

}  // namespace diorama
