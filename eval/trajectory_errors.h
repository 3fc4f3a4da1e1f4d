// Absolute and relative pose errors of a trajectory, by the definitions of evo
// (github.com/MichaelGrupp/evo): APE of the translation part, RPE over consecutive matched poses.
#pragma once

#include <optional>

#include "core/trajectory.h"
#include "eval/alignment.h"
#include "eval/statistics.h"

namespace diorama {

// Times that differ by more are not the same frame.
inline constexpr int64_t kAssociationGap_ns = 10'000'000;

struct TrajectoryErrors {
  size_t matched = 0;    // pairs of poses with the same time
  Similarity alignment;  // truth <- estimate, as asked for
  // Scale of the best similarity, whatever the alignment; nothing when the estimate does not move.
  std::optional<double> sim3_scale;
  std::optional<Statistics> ape_trans_m;  // nothing without a pair
  std::optional<Statistics> ape_rot_rad;
  std::optional<Statistics> rpe_trans_m;  // nothing with fewer than two pairs
  std::optional<Statistics> rpe_rot_rad;
};

// Each pose of the shorter trajectory is matched with the nearest in time of the other one, the
// estimate is aligned (positions only), then compared.
TrajectoryErrors evaluateTrajectory(const Trajectory& estimate, const Trajectory& truth,
                                    Alignment alignment);

}  // namespace diorama
