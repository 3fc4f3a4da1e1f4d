// How an object moves relative to the camera: a Kalman filter on SE(3) with a constant velocity
// that is disturbed by the camera's acceleration (error state in the right tangent; Bar-Shalom, Li
// and Kirubarajan, Estimation with Applications to Tracking and Navigation, ch. 6). The size of
// the accelerations is learned from what the image corrects.
#pragma once

#include "core/se3.h"
#include "tracker/pose_solver.h"

namespace diorama {

// A pose as expected before the image is seen.
struct PosePrior {
  SE3 T_camera_model;
  Matrix6d information = Matrix6d::Zero();  // inverse covariance, right tangent
  bool independent = false;                 // of the images that the tracker has seen

  // Less than 1 where a pose is further away than the covariance explains: a jerk.
  double weightOf(const SE3& T_camera_model_found) const;
  // Logarithm, up to a constant, of a density with tails as heavy.
  double logDensity(const SE3& T_camera_model_found) const;
};

// The prior as one cue among those of the image.
class PriorCue : public Cue {
 public:
  explicit PriorCue(const PosePrior& prior) : prior_(prior) {}
  CueEquations linearise(const SE3& T_camera_model) override;

 private:
  const PosePrior prior_;
};

class MotionFilter {
 public:
  bool started() const { return started_; }
  void stop() { started_ = false; }

  // At a pose with the covariance of its own errors; how it moves is unknown.
  void start(const SE3& T_camera_model, const Matrix6d& covariance);

  // After `seconds`. The filter itself stays where it is.
  PosePrior predict(double seconds) const;

  // The pose found after `seconds` with the prediction among its cues, and the information of the
  // others.
  void correct(double seconds, const SE3& T_camera_model, const Matrix6d& information);

  // A pose found after `seconds` elsewhere: what was expected was wrong, not how it moves.
  void jump(double seconds, const SE3& T_camera_model, const Matrix6d& covariance);

 private:
  using Matrix12d = Eigen::Matrix<double, 12, 12>;
  struct State {
    SE3 T_camera_model;
    Vector6d velocity = Vector6d::Zero();      // right tangent, 1/s
    Matrix12d covariance = Matrix12d::Zero();  // of [pose, velocity]
  };
  State propagated(double seconds) const;
  void learnJerks(const Vector6d& corrected, const Matrix6d& before, const Matrix6d& after);

  bool started_ = false;
  State state_;
  double jerkiness_ = 1;  // variance of the accelerations over that to begin with
};

}  // namespace diorama
