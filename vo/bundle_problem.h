// The least squares of bundle adjustment: what moves, what is seen, and one damped step with the
// points eliminated.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "vo/bundle_adjustment.h"

namespace diorama::vo {

class BundleProblem {
 public:
  BundleProblem(const Camera& camera, Map& map, const BundleRequest& request,
                const VoOptions& options);

  bool empty() const { return slots_ == 0 || points_.empty(); }
  double cost() const;
  // One step with the damping `lambda`; false when it is not finite.
  bool step(double lambda);
  void keep();
  void restore();
  void keepCovariances();
  int dropOutliers();
  BundleReport report() const {
    return {static_cast<int>(window_.size()), static_cast<int>(points_.size()),
            static_cast<int>(observations_.size())};
  }

 private:
  using Matrix63d = Eigen::Matrix<double, 6, 3>;
  struct PointBlock {
    MapPoint* point = nullptr;
    size_t begin = 0, end = 0;  // of its observations
    Matrix3d V_inverse = Matrix3d::Zero();
    Vector3d g = Vector3d::Zero(), kept = Vector3d::Zero();
  };
  struct View {  // T_camera_world of a keyframe
    Matrix3d R;
    Vector3d t;
  };
  struct Motion {  // three keyframes, the change of their mean velocity, m/s, is small
    std::array<Keyframe*, 3> keyframes;
    std::array<double, 3> factors;  // of their positions, 1/s
    double variance;
    Vector3d change() const;
  };
  struct Factor {
    Keyframe* keyframe;
    const ObjectObservation* observation;
  };

  void chooseKeyframes(int window, bool metric);
  void choosePoints();
  void chooseObjects();
  void addPoint(PointBlock& block, double lambda);
  void eliminatePoint(const PointBlock& block);
  void addObjects();
  void chooseMotion(double acceleration);
  void addMotion();
  double motionCost() const;
  void move(const Eigen::VectorXd& step);
  void updateViews();
  const View& viewOf(const Observation& o) const { return views_[o.keyframe->view]; }
  std::optional<Vector2d> residual(const Observation& o, const Vector3d& p_world) const;
  double error(size_t observation, const Vector3d& p_world) const;

  const Camera& camera_;
  Map& map_;
  const VoOptions& options_;
  std::vector<Keyframe*> window_;  // those that move
  std::vector<View> views_;        // of all keyframes
  std::vector<PointBlock> points_;
  std::vector<Observation> observations_;
  std::vector<Matrix2d> whiten_;  // one per observation: covariance^-1/2
  std::vector<Matrix63d> W_;      // one per observation
  std::vector<Factor> factors_;
  std::vector<Motion> motions_;

  std::vector<int> object_slot_ = std::vector<int>(map_.objects.size(), -1);
  int slots_ = 0;
  Eigen::MatrixXd S_;  // upper triangle by blocks
  Eigen::VectorXd b_;
  std::vector<SE3> kept_poses_, kept_objects_;
};

}  // namespace diorama::vo
