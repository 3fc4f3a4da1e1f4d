// How the smoother linearises, and keeps old poses up to date: back-substitution, and linearising
// anew.
#include <algorithm>

#include "mapper/chain_smoother.h"

namespace diorama {
namespace {

// Poses that are back-substituted in the time that linearising one anew takes.
constexpr size_t kBackPerForward = 4;

// Poses behind the window move with the objects. They are looked at when an object has moved by
// this part of what makes it worth while to linearise everything anew.
constexpr double kWorthALook = 0.25;

bool isFar(const Vector6d& delta, double limit_m, double limit_rad) {
  return delta.head<3>().norm() > limit_m || delta.tail<3>().norm() > limit_rad;
}

}  // namespace

// ----------------------------------------------------------------- residuals in charts

ChartStep ChainSmoother::odometryPair(size_t from, const Pass* pass) const {
  const OdometryFactor& factor = graph_.odometry[from];
  const bool anew = factor.scale && pass && *factor.scale < pass->objects.size();
  const double s = !factor.scale ? 0
                   : anew        ? pass->objects[*factor.scale].translation.x()
                                 : logScale(*factor.scale);
  const LinearisedStep step =
      linearise(factor, graph_.odometry_kernel, T_world_camera(from), T_world_camera(from + 1), s);
  ChartStep out{inCharts(step, pose_deltas_[from], pose_deltas_[from + 1])};
  if (from == 0) out.J_a.setZero();
  if (!factor.scale) return out;
  out.scale = factor.scale;
  out.J_scale = step.J_scale;
  if (!anew) out.r -= out.J_scale * objects_[*factor.scale].delta[0];
  return out;
}

ChartPair ChainSmoother::objectPair(size_t pose, const ObjectFactor& factor,
                                    const Pass* pass) const {
  const bool anew = pass && factor.object < pass->objects.size();
  const LinearisedPair pair =
      linearise(factor, graph_.object_kernel, T_world_camera(pose),
                anew ? pass->objects[factor.object] : T_world_object(factor.object));
  ChartPair out =
      inCharts(pair, pose_deltas_[pose], anew ? Vector6d::Zero() : objects_[factor.object].delta);
  if (pose == 0) out.J_a.setZero();
  return out;
}

// ----------------------------------------------------------------- the backward pass

// Returns whether the oldest one still changed.
bool ChainSmoother::backSubstitute(size_t oldest) {
  const bool everything = oldest == 0;
  for (size_t k = newest(); k-- > oldest;) {
    const double change = backSubstituteOne(k);
    if (!everything && change < options_.wildfire) return false;
  }
  return true;
}

// A pose, and the objects that were let go at the one after it. Returns how much it changed.
double ChainSmoother::backSubstituteOne(size_t pose) {
  const auto drops = drops_.empty() ? drops_.end() : drops_.find(pose + 1);
  if (drops != drops_.end())
    for (auto drop = drops->second.drops.rbegin(); drop != drops->second.drops.rend(); ++drop)
      objects_[drop->object].delta = solveClique(drop->clique, pose_deltas_[pose + 1]);
  const Vector6d delta = solveClique(cliques_[pose], pose_deltas_[pose + 1]);
  const double change = (delta - pose_deltas_[pose]).cwiseAbs().maxCoeff();
  setPoseDelta(pose, delta);
  return change;
}

Vector6d ChainSmoother::solveClique(const Clique& clique, const Vector6d& camera) const {
  Vector6d rest = clique.d.cast<double>();
  const float* S = clique.S.data();
  const auto subtract = [&](const Vector6d& delta) {
    for (Eigen::Index i = 0; i < 6; ++i, S += 6)
      rest -= delta[i] * Eigen::Map<const Eigen::Matrix<float, 6, 1>>(S).cast<double>();
  };
  subtract(camera);
  for (size_t object : *clique.slots) subtract(objects_[object].delta);
  return rest;
}

void ChainSmoother::setPoseDelta(size_t pose, const Vector6d& delta) {
  Vector6d& old = pose_deltas_[pose];
  squares_m_ += delta.head<3>().squaredNorm() - old.head<3>().squaredNorm();
  squares_rad_ += delta.tail<3>().squaredNorm() - old.tail<3>().squaredNorm();
  old = delta;
}

void ChainSmoother::sweep() {
  finishPass();
  backSubstitute(0);
}

// ----------------------------------------------------------------- linearising anew

bool ChainSmoother::movedFar() const {
  const double poses = static_cast<double>(poseCount());
  for (size_t object : root_.slots())
    if (isFar(objects_[object].delta, options_.relinearise_m, options_.relinearise_rad))
      return true;
  return squares_m_ > poses * options_.relinearise_m * options_.relinearise_m ||
         squares_rad_ > poses * options_.relinearise_rad * options_.relinearise_rad;
}

bool ChainSmoother::mayHaveMoved() const {
  const auto moved = [&](size_t object) {
    return isFar(objects_[object].delta - objects_[object].looked,
                 kWorthALook * options_.relinearise_m, kWorthALook * options_.relinearise_rad);
  };
  return older_moved_ || movedFar() ||
         std::any_of(root_.slots().begin(), root_.slots().end(), moved);
}

void ChainSmoother::relinearisePose(size_t pose) {
  graph_.poses[pose].T_world_camera = T_world_camera(pose);
  setPoseDelta(pose, Vector6d::Zero());
}

// The newest poses from the oldest one of the window that moved too far; objects stay in their
// charts.
void ChainSmoother::relineariseWindow() {
  for (size_t k = oldestOfWindow() + 1; k < poseCount(); ++k) {
    if (pose_deltas_[k].cwiseAbs().maxCoeff() <= options_.relinearise_window) continue;
    if (!savedRoot(k - 1)) continue;
    for (size_t i = k; i < poseCount(); ++i) relinearisePose(i);
    replayFrom(k - 1);
    backSubstitute(oldestOfWindow());
    return;
  }
}

double ChainSmoother::relinearise() {
  sweep();
  double step = 0;
  for (size_t k = 0; k < poseCount(); ++k) {
    step = std::max(step, pose_deltas_[k].cwiseAbs().maxCoeff());
    relinearisePose(k);
  }
  for (size_t j = 0; j < objectCount(); ++j) {
    step = std::max(step, objects_[j].delta.cwiseAbs().maxCoeff());
    graph_.objects[j].T_world_object = T_world_object(j);
    objects_[j].delta.setZero();
  }
  startOver();
  return step;
}

void ChainSmoother::moveTo(const Graph& values) {
  for (size_t k = 0; k < poseCount(); ++k) {
    graph_.poses[k].T_world_camera = values.poses[k].T_world_camera;
    pose_deltas_[k].setZero();
  }
  for (size_t j = 0; j < objectCount(); ++j) {
    graph_.objects[j].T_world_object = values.objects[j].T_world_object;
    objects_[j].delta.setZero();
  }
  startOver();
}

// Everything from the first pose on; all charts are where the variables stand.
void ChainSmoother::startOver() {
  pass_ = {};
  poses_at_pass_ = poseCount();
  older_moved_ = false;
  for (ObjectState& object : objects_) object.looked.setZero();
  squares_m_ = squares_rad_ = 0;
  for (SavedRoot& saved : saved_) saved.valid = false;
  replayFrom(0);
  backSubstitute(0);
}

// ----------------------------------------------------------------- the pass over everything

void ChainSmoother::advancePass() {
  if (pass_.stage == Pass::Stage::kIdle) {
    const double added = static_cast<double>(poseCount() - poses_at_pass_);
    if (added < options_.relinearise_growth * static_cast<double>(poseCount())) return;
    if (!mayHaveMoved()) return;
    poses_at_pass_ = poseCount();
    older_moved_ = false;
    for (ObjectState& object : objects_) object.looked = object.delta;
    pass_.stage = Pass::Stage::kBack;
    pass_.at = newest();
  }
  if (pass_.stage == Pass::Stage::kBack) passBack();
  if (pass_.stage == Pass::Stage::kForward) passForward();
}

void ChainSmoother::passBack() {
  const size_t most = kBackPerForward * static_cast<size_t>(options_.pass_poses);
  for (size_t i = 0; i < most && pass_.at > 0; ++i) backSubstituteOne(--pass_.at);
  if (pass_.at > 0) return;
  pass_ = {};
  if (!movedFar()) return;
  pass_.stage = Pass::Stage::kForward;
  for (size_t j = 0; j < objectCount(); ++j) pass_.objects.push_back(T_world_object(j));
}

// The window is done in one go, when the pass arrives there.
void ChainSmoother::passForward() {
  for (int i = 0; i < options_.pass_poses; ++i) {
    if (pass_.at + 1 >= oldestOfWindow()) return finishPass();
    settle(pass_.root, pass_.at, &pass_);
    relinearisePose(pass_.at + 1);
    cliques_[pass_.at] = pass_.root.advance(odometryPair(pass_.at, &pass_));
    const auto drops = drops_.find(++pass_.at);
    if (drops != drops_.end()) drops->second.before = pass_.root;
  }
}

void ChainSmoother::finishPass() {
  const Pass pass = std::move(pass_);
  pass_ = {};
  if (pass.stage != Pass::Stage::kForward) return;
  for (size_t j = 0; j < pass.objects.size(); ++j) {
    const SE3 T = T_world_object(j);
    graph_.objects[j].T_world_object = pass.objects[j];
    objects_[j].delta = log(pass.objects[j].inverse() * T);
    objects_[j].looked.setZero();
  }
  for (size_t k = pass.at + 1; k < poseCount(); ++k) relinearisePose(k);
  for (SavedRoot& saved : saved_) saved.valid = false;
  root_ = pass.root;
  saveRoot(pass.at);
  replayOn(pass.at);
  backSubstitute(oldestOfWindow());
}

// What stands behind the window must not be asked for while a part of it stands in other charts.
void ChainSmoother::finishPassBefore(size_t pose) {
  if (pass_.stage == Pass::Stage::kForward && pose < oldestOfWindow()) finishPass();
}

}  // namespace diorama
