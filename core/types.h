// Shorthands for the fixed-size Eigen types that every module uses.
#pragma once

#include <Eigen/Core>

namespace diorama {

using Vector2d = Eigen::Vector2d;
using Vector3d = Eigen::Vector3d;
using Vector3f = Eigen::Vector3f;
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix2d = Eigen::Matrix2d;
using Matrix3d = Eigen::Matrix3d;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix23d = Eigen::Matrix<double, 2, 3>;
using Matrix26d = Eigen::Matrix<double, 2, 6>;

}  // namespace diorama
