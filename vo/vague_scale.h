// What an unknown scale does to the reported motion. All steps are too long or too short by the
// same factor, but whoever adds up their covariances takes their errors for independent: so that
// the sum is as vague as the way is long, each step that leads farther from the start has the
// variance by which the square of the distance grows.
#pragma once

#include "core/se3.h"

namespace diorama::vo {

class VagueScale {
 public:
  void begin() { *this = {}; }  // lengths are others from here on

  // To be added to the covariance of a step whose length has this relative standard deviation.
  Matrix6d add(const SE3& T_from_to, double sigma);

 private:
  SE3 T_start_now_;
  double farthest_m_ = 0;
};

}  // namespace diorama::vo
