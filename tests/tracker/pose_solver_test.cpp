#include "tracker/pose_solver.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>

#include "core/camera.h"
#include "core/random.h"
#include "tests/tracker/box_scene.h"

namespace diorama {
namespace {

// Points that were seen where the true pose puts them.
class PointCue : public Cue {
 public:
  PointCue(const Camera& camera, const SE3& truth, int count) : camera_(camera) {
    const Random random(3, RandomStream::kTest);
    for (int i = 0; i < count; ++i) {
      const auto u = random.uniform(1, static_cast<uint64_t>(i));
      points_.push_back(0.1 * Vector3d(u[0] - 0.5, u[1] - 0.5, u[2] - 0.5));
      seen_.push_back(*camera.project(truth * points_.back()));
    }
  }
  CueEquations linearise(const SE3& T) override {
    CueEquations equations;
    for (size_t i = 0; i < points_.size(); ++i) {
      const auto projection = camera_.projectWithJacobian(T * points_[i]);
      if (!projection) continue;
      const Matrix26d J = pointJacobian(projection->J, T.rotationMatrix(), points_[i]);
      const Vector2d r = projection->u_px - seen_[i];
      for (int k = 0; k < 2; ++k) equations.add(J.row(k).transpose(), r[k], 1);
      equations.residuals += 2;
    }
    return equations;
  }

 private:
  const Camera& camera_;
  std::vector<Vector3d> points_;
  std::vector<Vector2d> seen_;
};

class NanCue : public Cue {
 public:
  CueEquations linearise(const SE3&) override {
    CueEquations equations;
    equations.hessian.setConstant(std::numeric_limits<double>::quiet_NaN());
    equations.gradient.setConstant(std::numeric_limits<double>::quiet_NaN());
    equations.residuals = 100;
    return equations;
  }
};

TEST(PoseSolver, PointJacobianAgreesWithDifferences) {
  const test::BoxScene scene;
  const SE3 T = test::boxPose(0.4);
  const Random random(2, RandomStream::kTest);
  for (int i = 0; i < 30; ++i) {
    const auto u = random.uniform(0, static_cast<uint64_t>(i));
    const Vector3d p(0.1 * u[0] - 0.05, 0.1 * u[1] - 0.05, 0.2 * u[2]);
    const auto projection = scene.camera.projectWithJacobian(T * p);
    ASSERT_TRUE(projection);
    const Matrix26d J = pointJacobian(projection->J, T.rotationMatrix(), p);
    for (int k = 0; k < 6; ++k) {
      constexpr double h = 1e-6;
      const Vector6d xi = h * Vector6d::Unit(k);
      const Vector2d numeric =
          (*scene.camera.project(T * exp(xi) * p) - *scene.camera.project(T * exp(-xi) * p)) /
          (2 * h);
      EXPECT_LT((J.col(k) - numeric).norm(), 1e-5 * (1 + numeric.norm()));
    }
  }
}

TEST(PoseSolver, ConvergesToTheTruth) {
  const test::BoxScene scene;
  const SE3 truth = test::boxPose(0.2);
  PointCue first(scene.camera, truth, 6), second(scene.camera, truth, 9);
  Cue* const cues[] = {&first, &second};
  Vector6d off;
  off << 0.02, -0.03, 0.04, 0.2, -0.1, 0.15;
  SolverLimits limits;
  limits.iterations = 12;
  const PoseSolution solution = solvePose(truth * exp(off), cues, limits);
  EXPECT_LT(log(truth.inverse() * solution.T_camera_model).norm(),
            1e-6);  // it stops at steps of 1e-5
}

// A cue that knows one direction hardly at all, and wants to go far along it.
class VagueCue : public Cue {
 public:
  CueEquations linearise(const SE3&) override {
    CueEquations equations;
    equations.hessian = Vector6d(1e4, 1e4, 1e4, 1e4, 1e4, 1e-3).asDiagonal();
    equations.gradient << 1, 0, 0, 0, 0, -2e-3;  // steps of 1e-4 m and 2 rad
    equations.residuals = 100;
    return equations;
  }
};

TEST(PoseSolver, OfWhatIsHardlyKnownStepsAreShort) {
  VagueCue cue;
  Cue* const cues[] = {&cue};
  SolverLimits limits;
  limits.iterations = 1;
  limits.model_diameter = 0.1;
  const SE3 start = test::boxPose();
  const auto turned = [&] {
    return angleBetween(start.rotation, solvePose(start, cues, limits).T_camera_model.rotation);
  };
  EXPECT_NEAR(turned(), 2, 1e-3);
  limits.motion.diagonal() << 1, 1, 1, 1, 1, 100;  // 0.1 rad are as far as it sees
  EXPECT_LE(turned(), 0.1 + 1e-9);
  const Vector6d moved = log(start.inverse() * solvePose(start, cues, limits).T_camera_model);
  EXPECT_NEAR(moved[0], -1e-4, 1e-6);  // what is known well is not held back
}

TEST(PoseSolver, NanNeverComesOut) {
  NanCue bad;
  Cue* const cues[] = {&bad};
  const SE3 start = test::boxPose();
  const PoseSolution solution = solvePose(start, cues, {});
  EXPECT_TRUE(solution.T_camera_model.isFinite());
  EXPECT_LT(log(start.inverse() * solution.T_camera_model).norm(), 1e-12);
  EXPECT_TRUE(covarianceFromHessian(solution.hessian(), 1, 1).allFinite());
}

TEST(PoseSolver, TooFewResidualsMoveNothing) {
  const test::BoxScene scene;
  const SE3 truth = test::boxPose(0.2);
  PointCue three(scene.camera, truth, 3);
  Cue* const cues[] = {&three};
  const SE3 start = truth * exp(Vector6d::Constant(0.01));
  EXPECT_LT(log(start.inverse() * solvePose(start, cues, {}).T_camera_model).norm(), 1e-12);
}

TEST(PoseSolver, CovarianceOfUndeterminedDirectionsIsLarge) {
  Matrix6d hessian = Matrix6d::Zero();
  hessian(0, 0) = 1e8;
  const Matrix6d covariance = covarianceFromHessian(hessian, 0.5, 2);
  EXPECT_NEAR(covariance(0, 0), 1e-8, 1e-12);
  EXPECT_NEAR(covariance(1, 1), 0.25, 1e-9);
  EXPECT_NEAR(covariance(5, 5), 4, 1e-9);
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Matrix6d>(covariance).eigenvalues().minCoeff(), 0);
}

TEST(PoseSolver, RobustScaleIgnoresOutliers) {
  const Random random(4, RandomStream::kTest);
  std::vector<double> values;
  for (uint64_t i = 0; i < 500; ++i)
    for (const double n : random.normal(0, i)) values.push_back(std::abs(0.7 * n));
  for (int i = 0; i < 200; ++i) values.push_back(1e6);
  EXPECT_NEAR(robustScale(values), 0.79, 0.05);  // the median of 10% more values
  std::vector<double> none;
  EXPECT_EQ(robustScale(none), 0);
  EXPECT_EQ(tukeyWeight(5, 4.6851), 0);
  EXPECT_EQ(tukeyWeight(0, 4.6851), 1);
}

}  // namespace
}  // namespace diorama
