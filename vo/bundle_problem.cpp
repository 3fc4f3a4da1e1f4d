#include "vo/bundle_problem.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "vo/motion_model.h"
#include "vo/object_scale.h"
#include "vo/pose_refinement.h"

namespace diorama::vo {
namespace {

// Standard deviations that hold 99% of right measurements of objects (chi-square, 6 dof).
constexpr double kObjectWidth = 4.1;
constexpr double kDropPx = 2.5;  // at the level; observations farther off at the end are wrong
// Features, of points that others saw, below which a keyframe's pose is not to be adjusted.
constexpr int kFewestSeen = 12;
constexpr double kFarOff = 1e3;  // standard deviations: a point behind the camera
constexpr double kPointDamping = 1e-6,
                 kPoseDamping = 1e-6;  // a point seen along one ray has no depth

// Cost and weight of Huber's kernel for an error e in units of its width.
double huberCost(double e, double width) {
  return e < width ? 0.5 * e * e : width * (e - 0.5 * width);
}
double huberWeight(double e, double width) { return e < width ? 1 : width / e; }

// ... and of one whose pull falls beyond it: an object that has moved is far off.
double fallingCost(double e, double width) {
  return e < width ? 0.5 * e * e : width * width * (0.5 + std::log(e / width));
}
double fallingWeight(double e, double width) { return e < width ? 1 : width * width / (e * e); }

}  // namespace

BundleProblem::BundleProblem(const Camera& camera, Map& map, const BundleRequest& request,
                             const VoOptions& options)
    : camera_(camera), map_(map), options_(options) {
  chooseKeyframes(request.window, request.metric);
  choosePoints();
  if (request.metric) chooseObjects();
  if (request.acceleration > 0) chooseMotion(request.acceleration);
  for (size_t i = 0; i < map_.keyframes.size(); ++i) map_.keyframes[i]->view = i;
  updateViews();
}

void BundleProblem::updateViews() {
  views_.clear();
  for (const auto& keyframe : map_.keyframes) {
    const SE3 T_camera_world = keyframe->T_world_camera.inverse();
    views_.push_back({T_camera_world.rotationMatrix(), T_camera_world.translation});
  }
}

namespace {

// A keyframe that the camera has turned to sees little that others saw.
bool isHeld(const Keyframe& keyframe) {
  int seen = 0;
  for (const Feature& feature : keyframe.features)
    seen += !feature.point->bad && feature.point->observations.size() >= 2;
  return seen >= kFewestSeen;
}

}  // namespace

// The first keyframe is the gauge. Without any object's word the scale is a gauge, too, that the
// second keyframe holds until both have left the window.
void BundleProblem::chooseKeyframes(int window, bool metric) {
  const size_t n = map_.keyframes.size();
  const size_t first = n > static_cast<size_t>(window) ? n - static_cast<size_t>(window) : 0;
  const size_t fixed = metric ? 1 : 2;
  for (size_t i = 0; i < n; ++i) {
    Keyframe& keyframe = *map_.keyframes[i];
    keyframe.slot = -1;
    if (i < first || i < fixed || !isHeld(keyframe)) continue;
    keyframe.slot = slots_++;
    window_.push_back(&keyframe);
  }
}

void BundleProblem::choosePoints() {
  for (const auto& point : map_.points) point->mark = 0;
  for (const Keyframe* keyframe : window_)
    for (const Feature& feature : keyframe->features) {
      MapPoint& point = *feature.point;
      if (point.bad || point.mark != 0 || point.observations.size() < 2) continue;
      point.mark = 1;
      PointBlock block;
      block.point = &point;
      block.begin = observations_.size();
      int fixed = 0;
      for (const Observation& o : point.observations)
        if (o.keyframe->slot >= 0 || ++fixed <= options_.bundle_fixed_observations)
          observations_.push_back(o);
      block.end = observations_.size();
      points_.push_back(block);
    }
  W_.resize(observations_.size());
  for (const Observation& o : observations_)
    whiten_.push_back(o.covariance_px2.llt().matrixL().solve(Matrix2d::Identity()));
}

void BundleProblem::chooseObjects() {
  for (const auto& keyframe : map_.keyframes)
    for (const ObjectObservation& o : keyframe->objects) {
      factors_.push_back({keyframe.get(), &o});
      if (object_slot_[o.object] < 0) object_slot_[o.object] = slots_++;
    }
}

void BundleProblem::chooseMotion(double acceleration) {
  const auto& all = map_.keyframes;
  for (size_t i = 2; i < all.size(); ++i) {
    if (all[i]->slot < 0 && all[i - 1]->slot < 0 && all[i - 2]->slot < 0) continue;
    const double d1 =
        1e-9 * static_cast<double>(all[i - 1]->timestamp_ns - all[i - 2]->timestamp_ns);
    const double d2 = 1e-9 * static_cast<double>(all[i]->timestamp_ns - all[i - 1]->timestamp_ns);
    if (d1 > kSameMotion_s || d2 > kSameMotion_s) continue;
    motions_.push_back({{all[i - 2].get(), all[i - 1].get(), all[i].get()},
                        {1 / d1, -1 / d1 - 1 / d2, 1 / d2},
                        velocityChangeVariance(acceleration, d1, d2)});
  }
}

Vector3d BundleProblem::Motion::change() const {
  Vector3d sum = Vector3d::Zero();
  for (size_t i = 0; i < 3; ++i) sum += factors[i] * keyframes[i]->T_world_camera.translation;
  return sum;
}

double BundleProblem::motionCost() const {
  double sum = 0;
  for (const Motion& m : motions_) sum += 0.5 * m.change().squaredNorm() / m.variance;
  return sum;
}

void BundleProblem::addMotion() {
  for (const Motion& m : motions_) {
    const Vector3d r = m.change();
    for (size_t i = 0; i < 3; ++i) {
      const int a = m.keyframes[i]->slot;
      if (a < 0) continue;
      const Matrix3d R_a = m.keyframes[i]->T_world_camera.rotationMatrix();
      b_.segment<3>(6 * a) -= m.factors[i] / m.variance * R_a.transpose() * r;
      for (size_t j = 0; j < 3; ++j)
        if (const int c = m.keyframes[j]->slot; c >= a)
          S_.block<3, 3>(6 * a, 6 * c) += m.factors[i] * m.factors[j] / m.variance *
                                          R_a.transpose() *
                                          m.keyframes[j]->T_world_camera.rotationMatrix();
    }
  }
}

std::optional<Vector2d> BundleProblem::residual(const Observation& o,
                                                const Vector3d& p_world) const {
  const View& view = viewOf(o);
  const auto u = camera_.project(view.R * p_world + view.t);
  if (!u) return std::nullopt;
  return o.u_px - *u;
}

// In standard deviations.
double BundleProblem::error(size_t observation, const Vector3d& p_world) const {
  const auto r = residual(observations_[observation], p_world);
  return r ? (whiten_[observation] * *r).norm() : kFarOff;
}

double BundleProblem::cost() const {
  double sum = motionCost();
  for (const PointBlock& block : points_)
    for (size_t k = block.begin; k < block.end; ++k) {
      sum += huberCost(error(k, block.point->p_world), options_.bundle_huber);
    }
  for (const PointBlock& block : points_) {
    const Vector3d d = block.point->p_world - block.point->assumed_p_world;
    sum += 0.5 * d.dot(block.point->assumed_information * d);
  }
  for (const Factor& f : factors_) {
    const ObjectResidual e = objectResidual(f.keyframe->T_world_camera,
                                            map_.objects[f.observation->object].T_world_object,
                                            f.observation->T_camera_object);
    sum += fallingCost(std::sqrt(e.r.dot(f.observation->information * e.r)), kObjectWidth);
  }
  return sum;
}

void BundleProblem::addPoint(PointBlock& block, double lambda) {
  Matrix3d V = Matrix3d::Zero();
  block.g.setZero();
  for (size_t k = block.begin; k < block.end; ++k) {
    const Observation& o = observations_[k];
    const View& view = viewOf(o);
    const Vector3d p_camera = view.R * block.point->p_world + view.t;
    const auto projected = camera_.projectWithJacobian(p_camera);
    W_[k].setZero();
    if (!projected) continue;
    const Vector2d r = whiten_[k] * (o.u_px - projected->u_px);
    const double w = huberWeight(r.norm(), options_.bundle_huber);
    const Matrix23d J_image = whiten_[k] * projected->J;
    const Matrix23d J_point = J_image * view.R;
    V.noalias() += w * J_point.transpose() * J_point;
    block.g.noalias() += w * J_point.transpose() * r;
    if (o.keyframe->slot < 0) continue;
    const Matrix26d J_pose = poseJacobian(J_image, p_camera);
    const int at = 6 * o.keyframe->slot;
    S_.block<6, 6>(at, at).noalias() += w * J_pose.transpose() * J_pose;
    b_.segment<6>(at).noalias() += w * J_pose.transpose() * r;
    W_[k].noalias() = w * J_pose.transpose() * J_point;
  }
  const MapPoint& point = *block.point;
  V += point.assumed_information;
  block.g += point.assumed_information * (point.assumed_p_world - point.p_world);
  V.diagonal() *= 1 + lambda;
  V.diagonal().array() += kPointDamping;
  block.V_inverse = V.inverse();
}

void BundleProblem::eliminatePoint(const PointBlock& block) {
  for (size_t k = block.begin; k < block.end; ++k) {
    const int row = observations_[k].keyframe->slot;
    if (row < 0) continue;
    const Matrix63d WV = W_[k] * block.V_inverse;
    b_.segment<6>(6 * row).noalias() -= WV * block.g;
    for (size_t m = block.begin; m < block.end; ++m) {
      const int column = observations_[m].keyframe->slot;
      if (column >= row) S_.block<6, 6>(6 * row, 6 * column).noalias() -= WV * W_[m].transpose();
    }
  }
}

void BundleProblem::addObjects() {
  for (const Factor& f : factors_) {
    const ObjectObservation& o = *f.observation;
    const ObjectResidual e = objectResidual(
        f.keyframe->T_world_camera, map_.objects[o.object].T_world_object, o.T_camera_object);
    const double w = fallingWeight(std::sqrt(e.r.dot(o.information * e.r)), kObjectWidth);
    const Matrix6d information = w * o.information;
    const int object = 6 * object_slot_[o.object];
    S_.block<6, 6>(object, object) += e.J_object.transpose() * information * e.J_object;
    b_.segment<6>(object) -= e.J_object.transpose() * information * e.r;
    if (f.keyframe->slot < 0) continue;
    const int pose = 6 * f.keyframe->slot;
    S_.block<6, 6>(pose, pose) += e.J_camera.transpose() * information * e.J_camera;
    S_.block<6, 6>(pose, object) += e.J_camera.transpose() * information * e.J_object;
    b_.segment<6>(pose) -= e.J_camera.transpose() * information * e.r;
  }
}

bool BundleProblem::step(double lambda) {
  S_ = Eigen::MatrixXd::Zero(6 * slots_, 6 * slots_);
  b_ = Eigen::VectorXd::Zero(6 * slots_);
  for (PointBlock& block : points_) addPoint(block, lambda);
  addObjects();
  addMotion();
  S_.diagonal() *= 1 + lambda;
  S_.diagonal().array() += kPoseDamping;
  for (const PointBlock& block : points_) eliminatePoint(block);
  const Eigen::VectorXd d = S_.selfadjointView<Eigen::Upper>().ldlt().solve(b_);
  if (!d.allFinite()) return false;
  move(d);
  return true;
}

void BundleProblem::move(const Eigen::VectorXd& d) {
  for (PointBlock& block : points_) {
    Vector3d g = block.g;
    for (size_t k = block.begin; k < block.end; ++k)
      if (const int slot = observations_[k].keyframe->slot; slot >= 0)
        g -= W_[k].transpose() * d.segment<6>(6 * slot);
    block.point->p_world += block.V_inverse * g;
  }
  for (Keyframe* keyframe : window_)
    keyframe->T_world_camera = keyframe->T_world_camera * exp(d.segment<6>(6 * keyframe->slot));
  for (size_t i = 0; i < map_.objects.size(); ++i)
    if (object_slot_[i] >= 0)
      map_.objects[i].T_world_object =
          map_.objects[i].T_world_object * exp(d.segment<6>(6 * object_slot_[i]));
  updateViews();
}

void BundleProblem::keep() {
  kept_poses_.clear();
  kept_objects_.clear();
  for (const Keyframe* keyframe : window_) kept_poses_.push_back(keyframe->T_world_camera);
  for (const MapObject& object : map_.objects) kept_objects_.push_back(object.T_world_object);
  for (PointBlock& block : points_) block.kept = block.point->p_world;
}

void BundleProblem::restore() {
  for (size_t i = 0; i < window_.size(); ++i) window_[i]->T_world_camera = kept_poses_[i];
  for (size_t i = 0; i < map_.objects.size(); ++i)
    map_.objects[i].T_world_object = kept_objects_[i];
  for (const PointBlock& block : points_) block.point->p_world = block.kept;
  updateViews();
}

// As the last step saw them, the keyframes taken as known.
void BundleProblem::keepCovariances() {
  for (const PointBlock& block : points_) block.point->covariance = block.V_inverse;
}

int BundleProblem::dropOutliers() {
  int dropped = 0;
  for (const PointBlock& block : points_) {
    MapPoint& point = *block.point;
    std::erase_if(point.observations, [&](const Observation& o) {
      const auto r = residual(o, point.p_world);
      if (r && o.errorPx(*r) <= kDropPx) return false;
      std::erase_if(o.keyframe->features, [&](const Feature& f) { return f.point == &point; });
      ++dropped;
      return true;
    });
    if (point.observations.size() < 2) point.bad = true;
  }
  return dropped;
}

}  // namespace diorama::vo
