#include "eval/trajectory_errors.h"

#include <vector>

namespace diorama {
namespace {

struct Pairs {
  std::vector<SE3> estimate, truth;
};

Pairs associate(const Trajectory& estimate, const Trajectory& truth) {
  Pairs pairs;
  const bool by_estimate = estimate.poses.size() <= truth.poses.size();
  const Trajectory& shorter = by_estimate ? estimate : truth;
  const Trajectory& longer = by_estimate ? truth : estimate;
  for (const StampedPose& pose : shorter.poses) {
    const StampedPose* other = longer.nearest(pose.timestamp_ns, kAssociationGap_ns);
    if (!other) continue;
    pairs.estimate.push_back(by_estimate ? pose.pose : other->pose);
    pairs.truth.push_back(by_estimate ? other->pose : pose.pose);
  }
  return pairs;
}

std::vector<Vector3d> positions(const std::vector<SE3>& poses) {
  std::vector<Vector3d> points;
  for (const SE3& pose : poses) points.push_back(pose.translation);
  return points;
}

// As evo: positions are scaled, then the whole pose is moved.
SE3 aligned(const Similarity& alignment, const SE3& pose) {
  return alignment.T_target_source * SE3{pose.rotation, alignment.scale * pose.translation};
}

bool moves(const std::vector<Vector3d>& points) {
  for (const Vector3d& p : points)
    if ((p - points.front()).norm() > 1e-9) return true;
  return false;
}

}  // namespace

TrajectoryErrors evaluateTrajectory(const Trajectory& estimate, const Trajectory& truth,
                                    Alignment alignment) {
  Pairs pairs = associate(estimate, truth);
  TrajectoryErrors errors;
  errors.matched = pairs.truth.size();
  const std::vector<Vector3d> source = positions(pairs.estimate), target = positions(pairs.truth);
  errors.alignment = umeyama(source, target, alignment);
  if (moves(source)) errors.sim3_scale = umeyama(source, target, Alignment::kSim3).scale;

  std::vector<double> ape_trans, ape_rot, rpe_trans, rpe_rot;
  for (size_t i = 0; i < errors.matched; ++i) {
    SE3& pose = pairs.estimate[i];
    pose = aligned(errors.alignment, pose);
    const SE3 error = pairs.truth[i].inverse() * pose;
    ape_trans.push_back(error.translation.norm());
    ape_rot.push_back(logSO3(error.rotation).norm());
    if (i == 0) continue;
    const SE3 true_motion = pairs.truth[i - 1].inverse() * pairs.truth[i];
    const SE3 motion_error = true_motion.inverse() * (pairs.estimate[i - 1].inverse() * pose);
    rpe_trans.push_back(motion_error.translation.norm());
    rpe_rot.push_back(logSO3(motion_error.rotation).norm());
  }
  errors.ape_trans_m = summarise(ape_trans);
  errors.ape_rot_rad = summarise(ape_rot);
  errors.rpe_trans_m = summarise(rpe_trans);
  errors.rpe_rot_rad = summarise(rpe_rot);
  return errors;
}

}  // namespace diorama
