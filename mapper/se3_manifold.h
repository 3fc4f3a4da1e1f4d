// SE(3) as Ceres sees it: 7 numbers (translation, quaternion xyzw) with a 6-dimensional tangent.
#pragma once

#include <array>
#include <memory>

#include "core/se3.h"

namespace ceres {
class Manifold;
}

namespace diorama {

using PoseBlock = std::array<double, 7>;  // tx ty tz qx qy qz qw
using Matrix67d = Eigen::Matrix<double, 6, 7, Eigen::RowMajor>;
using Matrix76d = Eigen::Matrix<double, 7, 6, Eigen::RowMajor>;

PoseBlock toBlock(const SE3& pose);
SE3 fromBlock(const double* block);

// Derivative of T * Exp(xi) by xi at xi = 0, in the seven numbers of T, and its left inverse: a
// Jacobian by xi times the latter is one by the seven numbers, which is what Ceres asks for.
Matrix76d blockByTangent(const SE3& pose);
Matrix67d tangentByBlock(const SE3& pose);

// Plus(T, xi) = T * Exp(xi), Minus(T', T) = Log(T^-1 * T').
std::unique_ptr<ceres::Manifold> makeSE3Manifold();

}  // namespace diorama
