#include "vo/vague_scale.h"

#include <algorithm>

namespace diorama::vo {

Matrix6d VagueScale::add(const SE3& T_from_to, double sigma) {
  T_start_now_ = T_start_now_ * T_from_to;
  const double before_m = farthest_m_, step_m = T_from_to.translation.norm();
  farthest_m_ = std::max(farthest_m_, T_start_now_.translation.norm());
  const double square = step_m * step_m + farthest_m_ * farthest_m_ - before_m * before_m;
  Vector6d along = Vector6d::Zero();
  if (step_m > 0) along.head<3>() = T_from_to.rotation.conjugate() * T_from_to.translation / step_m;
  return sigma * sigma * square * along * along.transpose();
}

}  // namespace diorama::vo
