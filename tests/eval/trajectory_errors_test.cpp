#include "eval/trajectory_errors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/support/matchers.h"

namespace diorama {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)

constexpr int64_t kMillisecond = 1'000'000;

SE3 at(double x, double y, double z, double yaw = 0) { return {expSO3({0, 0, yaw}), {x, y, z}}; }

Trajectory make(const std::vector<SE3>& poses, int64_t step_ns = 100 * kMillisecond) {
  Trajectory trajectory;
  for (const SE3& pose : poses)
    trajectory.poses.push_back({static_cast<int64_t>(trajectory.poses.size()) * step_ns, pose});
  return trajectory;
}

TEST(Umeyama, FindsRotationTranslationAndScale) {
  Numbers numbers(1);
  for (int i = 0; i < 20; ++i) {
    const SE3 T = numbers.pose(3);
    const double scale = numbers.uniform(0.2, 5);
    std::vector<Vector3d> source, target;
    for (int k = 0; k < 10; ++k) {
      source.push_back(numbers.vector3(1));
      target.push_back(T * Vector3d(scale * source.back()));
    }
    const Similarity sim3 = umeyama(source, target, Alignment::kSim3);
    EXPECT_THAT(sim3.T_target_source, PoseNear(T, 1e-9, 1e-9));
    EXPECT_NEAR(sim3.scale, scale, 1e-9);
    EXPECT_EQ(umeyama(source, target, Alignment::kSE3).scale, 1);
    EXPECT_THAT(umeyama(source, target, Alignment::kNone).T_target_source, PoseNear(SE3{}, 0, 0));
  }
}

// The best orthogonal matrix of mirrored points is a reflection, which is no motion.
TEST(Umeyama, NeverReflects) {
  Numbers numbers(2);
  std::vector<Vector3d> source, target;
  for (int k = 0; k < 10; ++k) {
    source.push_back(numbers.vector3(1));
    target.push_back(source.back().cwiseProduct(Vector3d(-1, 1, 1)));
  }
  const Similarity s = umeyama(source, target, Alignment::kSE3);
  EXPECT_NEAR(s.T_target_source.rotationMatrix().determinant(), 1, 1e-9);
}

TEST(Umeyama, DegenerateInputGivesAFiniteMinimiser) {
  const std::vector<Vector3d> one{{1, 2, 3}}, other{{4, 4, 4}};
  Similarity s = umeyama(one, other, Alignment::kSim3);
  EXPECT_THAT(s.T_target_source, PoseNear(at(3, 2, 1), 1e-12, 1e-12));
  EXPECT_EQ(s.scale, 1);
  // Coincident points.
  const std::vector<Vector3d> same(5, Vector3d(1, 1, 1)),
      line{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}, {4, 0, 0}};
  s = umeyama(same, line, Alignment::kSim3);
  EXPECT_TRUE(s.T_target_source.isFinite());
  EXPECT_EQ(s.scale, 1);
  // On a line: the rotation about it is open, the points still meet.
  std::vector<Vector3d> turned;
  for (const Vector3d& p : line) turned.emplace_back(1, 2 * p.x(), 0);
  s = umeyama(line, turned, Alignment::kSim3);
  EXPECT_NEAR(s.scale, 2, 1e-9);
  for (size_t i = 0; i < line.size(); ++i)
    EXPECT_THAT(s.T_target_source * Vector3d(s.scale * line[i]), MatrixNear(turned[i], 1e-9));
  EXPECT_THAT(umeyama({}, {}, Alignment::kSim3).T_target_source, PoseNear(SE3{}, 0, 0));
}

TEST(TrajectoryErrors, HandComputedWithoutAlignment) {
  const Trajectory truth = make({at(0, 0, 0), at(1, 0, 0), at(2, 0, 0)});
  const Trajectory estimate = make({at(0, 0.1, 0), at(1, 0, 0.2), at(2.2, 0, 0.2, 0.3)});
  const TrajectoryErrors errors = evaluateTrajectory(estimate, truth, Alignment::kNone);
  EXPECT_EQ(errors.matched, 3u);
  // 0.1, 0.2, sqrt(0.08)
  EXPECT_NEAR(errors.ape_trans_m->mean, (0.3 + std::sqrt(0.08)) / 3, 1e-12);
  EXPECT_NEAR(errors.ape_trans_m->rmse, std::sqrt((0.01 + 0.04 + 0.08) / 3), 1e-12);
  EXPECT_NEAR(errors.ape_trans_m->median, 0.2, 1e-12);
  EXPECT_NEAR(errors.ape_rot_rad->max, 0.3, 1e-12);
  // Motions (1, -0.1, 0.2) and (1.2, 0, 0) instead of (1, 0, 0).
  EXPECT_NEAR(errors.rpe_trans_m->rmse, std::sqrt((0.05 + 0.04) / 2), 1e-12);
  EXPECT_NEAR(errors.rpe_rot_rad->rmse, 0.3 / std::sqrt(2), 1e-12);
}

TEST(TrajectoryErrors, AlignmentRemovesASimilarity) {
  Numbers numbers(3);
  std::vector<SE3> truth, moved;
  const SE3 T = numbers.pose(2);
  for (int i = 0; i < 20; ++i) {
    truth.push_back(numbers.pose(1));
    moved.push_back(T * truth.back());
  }
  TrajectoryErrors errors = evaluateTrajectory(make(moved), make(truth), Alignment::kSE3);
  EXPECT_NEAR(errors.ape_trans_m->max, 0, 1e-9);
  EXPECT_NEAR(errors.ape_rot_rad->max, 0, 1e-7);
  EXPECT_NEAR(errors.rpe_trans_m->max, 0, 1e-9);
  EXPECT_NEAR(errors.sim3_scale.value(), 1, 1e-9);

  for (SE3& pose : moved) pose.translation *= 0.5;
  errors = evaluateTrajectory(make(moved), make(truth), Alignment::kSE3);
  EXPECT_GT(errors.ape_trans_m->mean, 0.1);
  EXPECT_NEAR(errors.sim3_scale.value(), 2, 1e-9);
  errors = evaluateTrajectory(make(moved), make(truth), Alignment::kSim3);
  EXPECT_NEAR(errors.ape_trans_m->max, 0, 1e-9);
  EXPECT_NEAR(errors.rpe_trans_m->max, 0, 1e-9);
}

// A known least-squares answer: points at +-1 on x seen at +-1.1 stay 0.1 off after SE(3).
TEST(TrajectoryErrors, AlignedErrorIsTheResidualOfTheBestFit) {
  const Trajectory truth = make({at(-1, 0, 0), at(1, 0, 0), at(0, 2, 0), at(0, -2, 0)});
  const Trajectory estimate = make({at(-1.1, 0, 5), at(1.1, 0, 5), at(0, 2, 5), at(0, -2, 5)});
  const TrajectoryErrors errors = evaluateTrajectory(estimate, truth, Alignment::kSE3);
  EXPECT_NEAR(errors.ape_trans_m->mean, 0.05, 1e-9);
  EXPECT_NEAR(errors.ape_trans_m->rmse, std::sqrt(0.02 / 4), 1e-9);
  EXPECT_NEAR(errors.ape_trans_m->std, 0.05, 1e-9);
}

TEST(TrajectoryErrors, TimesAreMatchedWithinTenMilliseconds) {
  const Trajectory truth = make({at(0, 0, 0), at(1, 0, 0), at(2, 0, 0), at(3, 0, 0)});
  Trajectory estimate;
  estimate.poses = {{9 * kMillisecond, at(0, 0, 0)},
                    {111 * kMillisecond, at(9, 9, 9)},
                    {295 * kMillisecond, at(3, 0, 1)}};
  const TrajectoryErrors errors = evaluateTrajectory(estimate, truth, Alignment::kNone);
  EXPECT_EQ(errors.matched, 2u);
  EXPECT_NEAR(errors.ape_trans_m->max, 1, 1e-12);
  // The longer list may be the estimate.
  EXPECT_EQ(evaluateTrajectory(truth, estimate, Alignment::kNone).matched, 2u);
}

TEST(TrajectoryErrors, FewPosesGiveWhatIsKnown) {
  TrajectoryErrors errors = evaluateTrajectory({}, make({at(0, 0, 0)}), Alignment::kSim3);
  EXPECT_EQ(errors.matched, 0u);
  EXPECT_FALSE(errors.ape_trans_m);
  EXPECT_FALSE(errors.rpe_trans_m);
  EXPECT_FALSE(errors.sim3_scale);

  errors = evaluateTrajectory(make({at(1, 2, 3)}), make({at(0, 0, 0)}), Alignment::kSE3);
  EXPECT_EQ(errors.matched, 1u);
  EXPECT_NEAR(errors.ape_trans_m->mean, 0, 1e-12);
  EXPECT_FALSE(errors.rpe_trans_m);
  EXPECT_FALSE(errors.sim3_scale);

  errors = evaluateTrajectory(make({at(0, 0, 0), at(0, 1, 0)}), make({at(0, 0, 0), at(3, 0, 0)}),
                              Alignment::kSE3);
  EXPECT_NEAR(errors.ape_trans_m->max, 1, 1e-9);
  EXPECT_NEAR(errors.sim3_scale.value(), 3, 1e-9);
  EXPECT_TRUE(std::isfinite(errors.rpe_rot_rad->mean));

  // The camera stands still.
  errors = evaluateTrajectory(make({at(1, 1, 1), at(1, 1, 1)}), make({at(0, 0, 0), at(1, 0, 0)}),
                              Alignment::kSim3);
  EXPECT_FALSE(errors.sim3_scale);
  EXPECT_NEAR(errors.ape_trans_m->mean, 0.5, 1e-12);
}

}  // namespace
}  // namespace diorama
