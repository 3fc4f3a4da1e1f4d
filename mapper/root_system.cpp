#include "mapper/root_system.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>

#include "core/errors.h"

namespace diorama {
namespace {

// Information below this part of the largest one is rounding.
constexpr double kRounding = 1e-12;

// Of a matrix that is positive definite but for rounding.
Eigen::LLT<Matrix6d> factorise(const Matrix6d& A) {
  Eigen::LLT<Matrix6d> llt(A);
  if (llt.info() == Eigen::Success) return llt;
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(A);
  const Vector6d values =
      eigen.eigenvalues().cwiseMax(kRounding * eigen.eigenvalues().cwiseAbs().maxCoeff());
  llt.compute(eigen.eigenvectors() * values.asDiagonal() * eigen.eigenvectors().transpose());
  return llt;
}

}  // namespace

ChartPair inCharts(const LinearisedPair& pair, const Vector6d& delta_a, const Vector6d& delta_b) {
  ChartPair out{pair.r, pair.J_a, pair.J_b};
  if (!delta_a.isZero(0)) {
    out.J_a = pair.J_a * rightJacobian(delta_a);
    out.r.noalias() -= out.J_a * delta_a;
  }
  if (!delta_b.isZero(0)) {
    out.J_b = pair.J_b * rightJacobian(delta_b);
    out.r.noalias() -= out.J_b * delta_b;
  }
  return out;
}

RootSystem::RootSystem()
    : A_(Matrix6d::Identity()), b_(Vector6d::Zero()), slots_(std::make_shared<ObjectSlots>()) {}

bool RootSystem::holds(size_t object) const {
  return std::find(slots_->begin(), slots_->end(), object) != slots_->end();
}

Eigen::Index RootSystem::position(size_t object) const {
  const auto found = std::find(slots_->begin(), slots_->end(), object);
  DIORAMA_CHECK(found != slots_->end());
  return 6 + 6 * (found - slots_->begin());
}

void RootSystem::addObject(size_t object) {
  const Eigen::Index size = A_.rows();
  A_.conservativeResizeLike(Eigen::MatrixXd::Zero(size + 6, size + 6));
  b_.conservativeResizeLike(Eigen::VectorXd::Zero(size + 6));
  ObjectSlots slots = *slots_;
  slots.push_back(object);
  slots_ = std::make_shared<const ObjectSlots>(std::move(slots));
}

void RootSystem::absorb(const ChartPair& pair, size_t object) {
  const Eigen::Index at = position(object);
  A_.topLeftCorner<6, 6>().noalias() += pair.J_a.transpose() * pair.J_a;
  A_.block<6, 6>(at, at).noalias() += pair.J_b.transpose() * pair.J_b;
  const Matrix6d cross = pair.J_a.transpose() * pair.J_b;
  A_.block<6, 6>(0, at) += cross;
  A_.block<6, 6>(at, 0) += cross.transpose();
  b_.head<6>().noalias() -= pair.J_a.transpose() * pair.r;
  b_.segment<6>(at).noalias() -= pair.J_b.transpose() * pair.r;
}

void divideByTranspose(Columns6d& B, const Matrix6d& L) {
  for (Eigen::Index j = 0; j < 6; ++j) {
    for (Eigen::Index i = 0; i < j; ++i) B.col(j) -= L(j, i) * B.col(i);
    B.col(j) *= 1 / L(j, j);
  }
}

void divide(Columns6d& B, const Matrix6d& L) {
  for (Eigen::Index j = 6; j-- > 0;) {
    for (Eigen::Index i = j + 1; i < 6; ++i) B.col(j) -= L(i, j) * B.col(i);
    B.col(j) *= 1 / L(j, j);
  }
}

// Written out, since the library's products are made for larger or for fixed sizes.
void subtractSquare(Eigen::MatrixXd& A, const Columns6d& B) {
  const Eigen::Index size = B.rows();
  const double* b = B.data();
  for (Eigen::Index j = 0; j < size; ++j) {
    double* a = A.col(j).data();
    const Vector6d w = B.row(j);
    for (Eigen::Index i = 0; i < size; ++i)
      a[i] -= w[0] * b[i] + w[1] * b[i + size] + w[2] * b[i + 2 * size] + w[3] * b[i + 3 * size] +
              w[4] * b[i + 4 * size] + w[5] * b[i + 5 * size];
  }
}

// With A11 = L L^T: S = L^-1 A12, A22 <- A22 - S^T S, b2 <- b2 - S^T L^-1 b1, where 1 is the camera
// and 2 the next pose, which had no entries before, and the objects. St is S^T: long columns.
Clique RootSystem::advance(const ChartStep& odometry) {
  const Eigen::Index objects = size() - 6;
  Matrix6d A11 = A_.topLeftCorner<6, 6>();
  A11.noalias() += odometry.J_a.transpose() * odometry.J_a;
  Vector6d b1 = b_.head<6>();
  b1.noalias() -= odometry.J_a.transpose() * odometry.r;
  const Eigen::LLT<Matrix6d> llt = factorise(A11);
  Columns6d St(size(), 6);
  St.topRows<6>().noalias() = odometry.J_b.transpose() * odometry.J_a;
  St.bottomRows(objects) = A_.bottomLeftCorner(objects, 6);
  if (odometry.scale)
    St.row(position(*odometry.scale)) += odometry.J_scale.transpose() * odometry.J_a;
  divideByTranspose(St, llt.matrixLLT());
  const Vector6d d = llt.matrixL().solve(b1);

  A_.leftCols<6>().setZero();
  A_.topRows<6>().setZero();
  A_.topLeftCorner<6, 6>().noalias() = odometry.J_b.transpose() * odometry.J_b;
  b_.head<6>().noalias() = -odometry.J_b.transpose() * odometry.r;
  if (odometry.scale) absorbScale(odometry);
  subtractSquare(A_, St);
  b_.noalias() -= St.lazyProduct(d);
  divide(St, llt.matrixLLT());
  return {St.transpose().cast<float>(), Vector6d(llt.matrixU().solve(d)).cast<float>(), slots_};
}

// The residual's part in the rows of the scale.
void RootSystem::absorbScale(const ChartStep& odometry) {
  const Eigen::Index at = position(*odometry.scale);
  const Vector6d cross = odometry.J_b.transpose() * odometry.J_scale;
  A_.block<6, 1>(0, at) += cross;
  A_.block<1, 6>(at, 0) += cross.transpose();
  A_(at, at) += odometry.J_scale.squaredNorm();
  b_[at] -= odometry.J_scale.dot(odometry.r);
}

Clique RootSystem::eliminate(size_t object) {
  const Eigen::Index at = position(object), rest = size() - 6, behind = rest - at;
  const Eigen::LLT<Matrix6d> llt = factorise(A_.block<6, 6>(at, at));
  Eigen::MatrixXd A12(6, rest), A22(rest, rest);
  A12 << A_.block(at, 0, 6, at), A_.block(at, at + 6, 6, behind);
  A22 << A_.topLeftCorner(at, at), A_.topRightCorner(at, behind),  //
      A_.bottomLeftCorner(behind, at), A_.bottomRightCorner(behind, behind);
  Eigen::VectorXd b2(rest);
  b2 << b_.head(at), b_.tail(behind);

  const Eigen::Matrix<double, 6, Eigen::Dynamic> S = llt.matrixL().solve(A12);
  const Vector6d d = llt.matrixL().solve(Vector6d(b_.segment<6>(at)));
  A_ = A22 - S.transpose() * S;
  b_ = b2 - S.transpose() * d;
  ObjectSlots slots = *slots_;
  slots.erase(std::find(slots.begin(), slots.end(), object));
  slots_ = std::make_shared<const ObjectSlots>(std::move(slots));
  return {llt.matrixU().solve(S).cast<float>(), Vector6d(llt.matrixU().solve(d)).cast<float>(),
          slots_};
}

RootSystem::Solution RootSystem::solve() const {
  Solution out;
  const Eigen::LLT<Eigen::MatrixXd> llt(A_);
  if (llt.info() == Eigen::Success) {
    out.delta = llt.solve(b_);
    Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(size(), size());  // L^-1
    llt.matrixL().solveInPlace(inverse);
    out.P.noalias() = inverse.transpose() * inverse.triangularView<Eigen::Lower>();
    if (out.delta.allFinite() && out.P.allFinite()) return out;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(A_);
  const double least = kRounding * eigen.eigenvalues().cwiseAbs().maxCoeff();
  out.P = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(least).cwiseInverse().asDiagonal() *
          eigen.eigenvectors().transpose();
  // What is said of those directions is rounding, too: nothing moves along them.
  const Eigen::VectorXd gains =
      (eigen.eigenvalues().array() > least).select(eigen.eigenvalues().cwiseInverse(), 0);
  out.delta = eigen.eigenvectors() * (gains.asDiagonal() * (eigen.eigenvectors().transpose() * b_));
  return out;
}

}  // namespace diorama
