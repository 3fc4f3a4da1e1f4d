#include "mapper/chain_smoother.h"

#include <algorithm>

#include "core/errors.h"

namespace diorama {
namespace {

// Of the numbers of a scale's variable that mean nothing, one sigma.
constexpr double kOfNoAccount = 1e-3;

}  // namespace

ChainSmoother::ChainSmoother(const SmootherOptions& options, const RobustKernel& object_kernel,
                             const RobustKernel& odometry_kernel)
    : options_(options), saved_(static_cast<size_t>(options.window_poses)) {
  graph_.object_kernel = object_kernel;
  graph_.odometry_kernel = odometry_kernel;
}

void ChainSmoother::start(int64_t timestamp_ns) {
  *this = ChainSmoother(options_, graph_.object_kernel, graph_.odometry_kernel);
  graph_.poses.push_back({SE3{}, timestamp_ns, {}});
  pose_deltas_.push_back(Vector6d::Zero());
  saveRoot(0);
}

void ChainSmoother::addPose(int64_t timestamp_ns, const OdometryFactor& odometry) {
  const size_t from = newest();
  if (odometry.scale) awaken(*odometry.scale);
  const SE3 Z = odometry.scale ? scaled(odometry.Z, logScale(*odometry.scale)) : odometry.Z;
  graph_.poses.push_back({T_world_camera(from) * Z, timestamp_ns, {}});
  pose_deltas_.push_back(Vector6d::Zero());
  graph_.odometry.push_back(odometry);
  const ChartStep step = odometryPair(from);
  cliques_.push_back(root_.advance(step));
  saveRoot(newest());
  std::optional<Eigen::Index> scale;
  if (odometry.scale) {
    objects_[*odometry.scale].last_seen = newest();
    scale = root_.position(*odometry.scale);
  }
  belief_.advance(step, scale);
  carryOn();
}

size_t ChainSmoother::addObject(const std::string& name, const SE3& T_world_object) {
  graph_.objects.push_back({name, T_world_object});
  objects_.emplace_back();
  return graph_.objects.size() - 1;
}

size_t ChainSmoother::addScale(double sigma) {
  const size_t scale = addObject("", {});
  Vector6d weights = Vector6d::Constant(1 / kOfNoAccount);
  weights[0] = 1 / sigma;
  addObservation(newest(), {scale, SE3{}, Whitening(weights.asDiagonal()), true});
  return scale;
}

void ChainSmoother::addObservation(size_t pose, const ObjectFactor& factor) {
  awaken(factor.object);
  if (pose != newest()) finishPassBefore(pose);
  std::vector<ObjectFactor>& seen = graph_.poses[pose].objects;
  seen.reserve(seen.size() + 1);  // there are many of these lists
  seen.push_back(factor);
  ObjectState& object = objects_[factor.object];
  object.last_seen = std::max(object.last_seen, pose);
  if (pose != newest()) return replayFrom(pose);
  const bool known = root_.holds(factor.object);
  if (!known) root_.addObject(factor.object);
  const ChartPair pair = objectPair(pose, factor);
  root_.absorb(pair, factor.object);
  if (!known) return solveRoot();
  belief_.absorb(pair, root_.position(factor.object));
  carryOn();
}

size_t ChainSmoother::removeObservations(size_t object, size_t from_pose) {
  awaken(object);
  finishPassBefore(from_pose);
  std::optional<size_t> first;
  size_t left = 0;
  for (size_t k = 0; k < poseCount(); ++k) {
    std::vector<ObjectFactor>& seen = graph_.poses[k].objects;
    const auto isOfObject = [&](const ObjectFactor& factor) { return factor.object == object; };
    if (k < from_pose)
      left += static_cast<size_t>(std::count_if(seen.begin(), seen.end(), isOfObject));
    else if (std::erase_if(seen, isOfObject) > 0 && !first)
      first = k;
  }
  if (first) replayFrom(*first);
  return left;
}

std::optional<double> ChainSmoother::innovation(size_t pose, const ObjectFactor& factor) {
  awaken(factor.object);
  // Not weighed by the kernel: the gate sees the whole residual.
  const LinearisedPair white =
      whitened(linearise(factor.Z, T_world_camera(pose), T_world_object(factor.object)),
               factor.W.matrix(), {});
  ChartPair pair = inCharts(white, pose_deltas_[pose], objects_[factor.object].delta);
  if (pose == 0) pair.J_a.setZero();
  if (pose == newest()) {
    if (!root_.holds(factor.object)) return std::nullopt;
    return belief_.innovation(pair, root_.position(factor.object));
  }
  finishPassBefore(pose);
  const RootSystem* saved = savedRoot(pose);
  if (!saved || !saved->holds(factor.object)) return std::nullopt;
  const JointBelief belief(saved->solve(), pose == 0);
  // What the later poses said about the mean is used; the covariance is that of the time.
  const Eigen::Index at = saved->position(factor.object);
  const Vector6d then =
      pair.J_a * belief.delta().head<6>() + pair.J_b * belief.delta().segment<6>(at);
  pair.r += pair.J_a * pose_deltas_[pose] + pair.J_b * objects_[factor.object].delta - then;
  return belief.innovation(pair, at);
}

void ChainSmoother::update() {
  if (++steps_since_solve_ >= options_.solve_every) solveRoot();
  if (backSubstitute(oldestOfWindow())) older_moved_ = true;
  relineariseWindow();
  advancePass();
  dropDormant();
}

bool ChainSmoother::inWindow(size_t pose) const { return savedRoot(pose) != nullptr; }

SE3 ChainSmoother::T_world_camera(size_t pose) const {
  return graph_.poses[pose].T_world_camera * exp(pose_deltas_[pose]);
}

SE3 ChainSmoother::T_world_object(size_t object) const {
  return graph_.objects[object].T_world_object * exp(objects_[object].delta);
}

Graph ChainSmoother::estimate() const {
  Graph out = graph_;
  for (size_t k = 0; k < poseCount(); ++k) out.poses[k].T_world_camera = T_world_camera(k);
  for (size_t j = 0; j < objectCount(); ++j) out.objects[j].T_world_object = T_world_object(j);
  return out;
}

ChainSmoother::Joint ChainSmoother::joint() const {
  Joint out{belief_.P(), root_.slots()};
  const auto toCurrent = [&](Eigen::Index at, const Vector6d& delta) {
    const Matrix6d J = rightJacobian(delta);
    out.P.middleRows<6>(at) = (J * out.P.middleRows<6>(at)).eval();
    out.P.middleCols<6>(at) = (out.P.middleCols<6>(at) * J.transpose()).eval();
  };
  toCurrent(0, pose_deltas_.back());
  for (size_t i = 0; i < out.slots.size(); ++i)
    toCurrent(6 + 6 * static_cast<Eigen::Index>(i), objects_[out.slots[i]].delta);
  return out;
}

ChainSmoother::PairCovariance ChainSmoother::covarianceWith(size_t object) const {
  const ObjectState& state = objects_[object];
  const Matrix6d J_camera = rightJacobian(pose_deltas_.back());
  PairCovariance out{cameraCovariance(), Matrix6d::Zero(), state.dormant_P};
  if (!root_.holds(object)) return out;
  const Eigen::Index at = root_.position(object);
  const Matrix6d J_object = rightJacobian(state.delta);
  out.cross = J_camera * belief_.P().block<6, 6>(0, at) * J_object.transpose();
  out.object = J_object * belief_.P().block<6, 6>(at, at) * J_object.transpose();
  return out;
}

Matrix6d ChainSmoother::objectCovariance(size_t object) const {
  const ObjectState& state = objects_[object];
  if (!root_.holds(object)) return state.dormant_P;
  const Eigen::Index at = root_.position(object);
  const Matrix6d J = rightJacobian(state.delta);
  return J * belief_.P().block<6, 6>(at, at) * J.transpose();
}

Matrix6d ChainSmoother::cameraCovariance() const {
  const Matrix6d J = rightJacobian(pose_deltas_.back());
  return J * belief_.P().topLeftCorner<6, 6>() * J.transpose();
}

// ----------------------------------------------------------------- the forward pass

// As of arriving at a pose: before anything that is seen from it.
void ChainSmoother::saveRoot(size_t pose) {
  SavedRoot& saved = saved_[pose % saved_.size()];
  saved.pose = pose;
  saved.valid = true;
  saved.root = root_;
}

const RootSystem* ChainSmoother::savedRoot(size_t pose) const {
  const SavedRoot& saved = saved_[pose % saved_.size()];
  if (saved.valid && saved.pose == pose) return &saved.root;
  const auto drops = drops_.find(pose);
  return drops != drops_.end() ? &drops->second.before : nullptr;
}

// What is seen from a pose, and the objects that are let go there.
void ChainSmoother::settle(RootSystem& root, size_t pose, const Pass* pass) {
  for (const ObjectFactor& factor : graph_.poses[pose].objects) {
    if (!root.holds(factor.object)) root.addObject(factor.object);
    root.absorb(objectPair(pose, factor, pass), factor.object);
  }
  const auto drops = drops_.find(pose);
  if (drops == drops_.end()) return;
  for (Drop& drop : drops->second.drops) drop.clique = root.eliminate(drop.object);
}

void ChainSmoother::replayFrom(size_t pose) {
  const RootSystem* saved = savedRoot(pose);
  if (pose == 0 || !saved) {
    pose = 0;
    root_ = RootSystem();
    saveRoot(0);
  } else {
    root_ = RootSystem(*saved);
  }
  replayOn(pose);
}

// Goes on to the newest pose from a root as of arriving at `pose`.
void ChainSmoother::replayOn(size_t pose) {
  settle(root_, pose);
  for (; pose < newest(); ++pose) {
    cliques_[pose] = root_.advance(odometryPair(pose));
    const auto drops = drops_.find(pose + 1);
    if (drops != drops_.end()) drops->second.before = root_;
    saveRoot(pose + 1);
    settle(root_, pose + 1);
  }
  solveRoot();
}

void ChainSmoother::solveRoot() {
  belief_ = JointBelief(root_.solve(), newest() == 0);
  steps_since_solve_ = 0;
  takeOver();
}

// After the belief was carried on.
void ChainSmoother::carryOn() {
  if (belief_.isSound())
    takeOver();
  else
    solveRoot();
}

void ChainSmoother::takeOver() {
  setPoseDelta(newest(), belief_.delta().head<6>());
  const ObjectSlots& slots = root_.slots();
  for (size_t i = 0; i < slots.size(); ++i)
    objects_[slots[i]].delta = belief_.delta().segment<6>(6 + 6 * static_cast<Eigen::Index>(i));
}

// ----------------------------------------------------------------- objects that go and come back

void ChainSmoother::awaken(size_t object) {
  ObjectState& state = objects_[object];
  if (!state.dropped_at) return;
  const size_t pose = *state.dropped_at;
  finishPassBefore(pose);
  std::vector<Drop>& drops = drops_.at(pose).drops;
  std::erase_if(drops, [&](const Drop& drop) { return drop.object == object; });
  state.dropped_at.reset();
  state.last_seen = newest();  // it is wanted now
  replayFrom(pose);
  if (drops.empty()) drops_.erase(pose);
}

// One that was released, or, when there are too many, the one that was not seen for longest.
std::optional<size_t> ChainSmoother::nextToDrop() const {
  const ObjectSlots& slots = root_.slots();
  const auto released = std::find_if(slots.begin(), slots.end(),
                                     [&](size_t object) { return objects_[object].released; });
  if (released != slots.end()) return *released;
  if (slots.size() <= static_cast<size_t>(options_.active_objects)) return std::nullopt;
  const size_t longest = *std::min_element(slots.begin(), slots.end(), [&](size_t a, size_t b) {
    return objects_[a].last_seen < objects_[b].last_seen;
  });
  const size_t unseen = newest() - objects_[longest].last_seen;
  if (unseen < static_cast<size_t>(options_.dormant_after_poses)) return std::nullopt;
  return longest;
}

void ChainSmoother::dropDormant() {
  bool dropped = false;
  while (const std::optional<size_t> object = nextToDrop()) {
    ObjectState& state = objects_[*object];
    if (!dropped) solveRoot();
    state.dormant_P = covarianceWith(*object).object;
    state.dropped_at = newest();
    auto [drops, first] = drops_.try_emplace(newest());
    if (first) drops->second.before = saved_[newest() % saved_.size()].root;
    drops->second.drops.push_back({*object, root_.eliminate(*object)});
    dropped = true;
    belief_ = JointBelief(root_.solve(), newest() == 0);
  }
}

}  // namespace diorama
