// Where an object is in the camera's frame now: what the graph says of it, joined with what the
// tracker has just measured.
//
// A tracker's errors are alike for a second or more, so that the graph, which adds frames up, must
// take each measurement for worse than it is. The one of this frame, taken by itself, is as good as
// it says. Both have part of their errors in common, and it is not known which: covariance
// intersection (Julier and Uhlmann 1997), both with the weight 1/2,
//   P^-1 = (P_graph^-1 + P_measured^-1) / 2,
// whose mean is that of independent errors, and whose covariance is never too small.
#pragma once

#include "core/measurements.h"

namespace diorama {

// A measurement that disagrees with the belief by more than `chi_square` (of the normalised
// difference) is less certain than it says: its covariance counts for as many times more.
ObjectPrediction joinMeasurement(const ObjectPrediction& believed, const SE3& measured,
                                 const Matrix6d& covariance, double chi_square);

}  // namespace diorama
