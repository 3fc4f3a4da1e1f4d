#include "mapper/landmarks.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/text.h"

namespace diorama {
namespace {

// Z Exp(e) S = (Z S) Exp(Ad(S^-1) e), so that W e = W Ad(S) e'.
ObjectFactor turned(const ObjectFactor& factor, const SE3& S) {
  return {factor.object, factor.Z * S, Whitening(factor.W.matrix() * adjoint(S))};
}

// The same without the correlation of camera and object, at which an object that was eliminated is
// not looked at closely.
constexpr double kFar = 10;

double mahalanobis(const Vector6d& e, const Matrix6d& P) { return e.dot(P.ldlt().solve(e)); }

}  // namespace

ObjectFactor nearestBySymmetry(const ObjectFactor& factor, const SE3& T_camera_object,
                               const Symmetries& symmetries) {
  ObjectFactor best = factor;
  const auto angle = [&](const ObjectFactor& f) {
    return angleBetween(f.Z.rotation, T_camera_object.rotation);
  };
  for (const SE3& S : symmetries.discrete) {
    ObjectFactor other = turned(factor, S);
    if (angle(other) < angle(best)) best = std::move(other);
  }
  if (!symmetries.axis) return best;
  // The turn about the axis that leaves least rotation: of the quaternion's part along the axis.
  const Eigen::Quaterniond rest = best.Z.rotation.conjugate() * T_camera_object.rotation;
  const double turn = 2 * std::atan2(rest.vec().dot(*symmetries.axis), rest.w());
  return turned(best, {expSO3(turn * *symmetries.axis), Vector3d::Zero()});
}

double Landmarks::Landmark::support() const { return past_runs + std::sqrt(run); }

void Landmarks::setSymmetries(const std::string& label, const Symmetries& symmetries) {
  labels_[label].symmetries = symmetries;
}

void Landmarks::doubt(const std::string& label) {
  for (Landmark& landmark : labels_[label].landmarks) landmark.past_runs = landmark.run = 0;
}

const Landmarks::Landmark& Landmarks::bestOf(const Label& label) {
  return *std::max_element(
      label.landmarks.begin(), label.landmarks.end(),
      [](const Landmark& a, const Landmark& b) { return a.support() < b.support(); });
}

std::optional<size_t> Landmarks::best(const std::string& label) const {
  const auto found = labels_.find(label);
  if (found == labels_.end() || found->second.landmarks.empty()) return std::nullopt;
  return bestOf(found->second).object;
}

double Landmarks::limit() const {
  if (options_.kind == "none") return INFINITY;
  return options_.kind == "paper" ? options_.paper_alpha * options_.paper_alpha
                                  : options_.chi_square;
}

double Landmarks::roughDistance(const ChainSmoother& smoother, size_t pose,
                                const ObjectFactor& factor) {
  const LinearisedPair pair =
      linearise(factor.Z, smoother.T_world_camera(pose), smoother.T_world_object(factor.object));
  const ChainSmoother::PairCovariance P = smoother.covarianceWith(factor.object);
  return mahalanobis(pair.r, pair.J_a * P.camera * pair.J_a.transpose() +
                                 pair.J_b * P.object * pair.J_b.transpose() + covarianceOf(factor));
}

double Landmarks::distance(ChainSmoother& smoother, size_t pose, const ObjectFactor& factor) const {
  if (options_.kind != "paper") {
    if (!smoother.isActive(factor.object) && roughDistance(smoother, pose, factor) > kFar * limit())
      return INFINITY;  // not worth waking it up
    const std::optional<double> innovation = smoother.innovation(pose, factor);
    return innovation ? *innovation : INFINITY;
  }
  const SE3 T_world_object = smoother.T_world_camera(pose) * factor.Z;
  const Vector6d e = log(smoother.T_world_object(factor.object).inverse() * T_world_object);
  return mahalanobis(e, smoother.covarianceWith(factor.object).object);
}

std::optional<Landmarks::Match> Landmarks::nearest(ChainSmoother& smoother, size_t pose,
                                                   Label& label, const ObjectFactor& factor,
                                                   std::optional<double>& best) const {
  std::optional<Match> match;
  if (label.landmarks.empty()) return match;
  const auto compare = [&](Landmark& landmark) {
    const SE3 expected =
        smoother.T_world_camera(pose).inverse() * smoother.T_world_object(landmark.object);
    Match candidate{&landmark, nearestBySymmetry(factor, expected, label.symmetries), 0};
    candidate.factor.object = landmark.object;
    candidate.distance = distance(smoother, pose, candidate.factor);
    const bool inside = candidate.distance < limit() || options_.kind == "none";
    if (inside && (!match || candidate.distance < match->distance)) match = candidate;
    return candidate.distance;
  };
  // The others get what is no measurement of it: a neighbour shall not share them.
  const Landmark* likely = &bestOf(label);
  for (Landmark& landmark : label.landmarks)
    if (&landmark == likely) best = compare(landmark);
  if (match) return match;
  for (Landmark& landmark : label.landmarks)
    if (&landmark != likely) compare(landmark);
  return match;
}

void Landmarks::count(Label& label, Landmark* matched) {
  if (matched) ++label.taken, ++matched->taken;
  for (Landmark& landmark : label.landmarks) {
    if (&landmark == matched) {
      ++landmark.run;
    } else {
      landmark.past_runs += std::sqrt(landmark.run);
      landmark.run = 0;
    }
  }
}

void Landmarks::forget(ChainSmoother& smoother, Label& label) const {
  const auto few = [&](size_t taken, int taken_before) {
    return static_cast<double>(taken) < options_.least_share * (label.taken - taken_before);
  };
  std::erase_if(label.tentative,
                [&](const Tentative& t) { return few(t.members.size(), t.taken_before); });
  const size_t best_object = bestOf(label).object;
  std::erase_if(label.landmarks, [&](const Landmark& landmark) {
    if (landmark.object == best_object) return false;
    if (!few(static_cast<size_t>(landmark.taken), landmark.taken_before)) return false;
    smoother.release(landmark.object);
    return true;
  });
}

Landmarks::Landmark& Landmarks::place(ChainSmoother& smoother, size_t pose, const std::string& name,
                                      Label& label, const ObjectFactor& factor) const {
  const size_t object = smoother.addObject(name, smoother.T_world_camera(pose) * factor.Z);
  label.landmarks.push_back({object, label.taken});
  return label.landmarks.back();
}

AddResult Landmarks::add(ChainSmoother& smoother, size_t pose, const std::string& name,
                         ObjectFactor factor) {
  Label& label = labels_[name];
  if (label.landmarks.empty()) {
    Landmark& first = place(smoother, pose, name, label, factor);
    factor.object = first.object;
    smoother.addObservation(pose, factor);
    count(label, &first);
    if (std::find(order_.begin(), order_.end(), name) == order_.end()) order_.push_back(name);
    return {true};
  }
  AddResult result;
  const std::optional<Match> match = nearest(smoother, pose, label, factor, result.innovation);
  if (match) {
    smoother.addObservation(pose, match->factor);
    count(label, match->landmark);
    result.added = match->landmark == &bestOf(label);
    forget(smoother, label);
    if (!result.added) result.reason = "agrees with another place of the object than the best one";
    return result;
  }
  count(label, nullptr);
  if (options_.kind == "innovation" && wait(smoother, pose, name, label, factor))
    return {true, "", result.innovation};
  result.reason = "outside the gate: " + formatFixed(result.innovation.value_or(INFINITY), 1) +
                  " where " + formatFixed(limit(), 1) + " is the limit";
  return result;
}

void Landmarks::takeBack(ChainSmoother& smoother, const std::string& name, size_t from_pose) {
  Label& label = labels_[name];
  label.tentative.clear();
  std::erase_if(label.landmarks, [&](const Landmark& landmark) {
    return smoother.removeObservations(landmark.object, from_pose) == 0;
  });
}

void Landmarks::settle(ChainSmoother& smoother, size_t pose, const std::string& name,
                       ObjectFactor factor) {
  doubt(name);
  Label& label = labels_[name];
  std::optional<double> ignored;
  std::optional<Match> match = nearest(smoother, pose, label, factor, ignored);
  if (!match) {
    if (label.landmarks.size() >= static_cast<size_t>(options_.max_landmarks)) {
      smoother.release(label.landmarks.front().object);
      label.landmarks.erase(label.landmarks.begin());
    }
    Landmark& landmark = place(smoother, pose, name, label, factor);
    factor.object = landmark.object;
    match = Match{&landmark, factor, 0};
  }
  smoother.addObservation(pose, match->factor);
  count(label, match->landmark);
}

bool Landmarks::agree(const ChainSmoother& smoother, const Waiting& waiting, size_t pose,
                      const ObjectFactor& factor) const {
  const SE3 a = smoother.T_world_camera(waiting.pose) * waiting.factor.Z;
  const SE3 b = smoother.T_world_camera(pose) * factor.Z;
  const Vector6d e = log(a.inverse() * b);
  Matrix6d S = covarianceOf(waiting.factor) + covarianceOf(factor);
  S.diagonal().head<3>().array() += options_.slack_m * options_.slack_m;
  S.diagonal().tail<3>().array() += options_.slack_rad * options_.slack_rad;
  return mahalanobis(e, S) < options_.chi_square;
}

// Whether the label stands for a new landmark after this, of which the measurement is one.
bool Landmarks::wait(ChainSmoother& smoother, size_t pose, const std::string& name, Label& label,
                     const ObjectFactor& factor) const {
  const SE3 T_camera_world = smoother.T_world_camera(pose).inverse();
  auto found = label.tentative.begin();
  ObjectFactor nearest = factor;
  for (; found != label.tentative.end(); ++found) {
    const Waiting& last = found->members.back();
    const SE3 expected = T_camera_world * smoother.T_world_camera(last.pose) * last.factor.Z;
    nearest = nearestBySymmetry(factor, expected, label.symmetries);
    if (agree(smoother, last, pose, nearest)) break;
  }
  if (found == label.tentative.end()) {
    if (label.tentative.size() >= static_cast<size_t>(options_.max_tentative))
      label.tentative.pop_front();
    label.tentative.push_back({label.taken, {{pose, factor}}});
    found = std::prev(label.tentative.end());
  } else {
    found->members.push_back({pose, nearest});
  }
  const bool enough = found->members.size() >= static_cast<size_t>(options_.support);
  if (!enough || label.landmarks.size() >= static_cast<size_t>(options_.max_landmarks))
    return false;
  const std::vector<Waiting> agreed = std::move(found->members);
  label.tentative.erase(found);
  Landmark& landmark = place(smoother, pose, name, label, agreed.back().factor);
  for (const Waiting& waiting : agreed) {
    if (!smoother.inWindow(waiting.pose)) continue;  // it has done its duty
    ObjectFactor buffered = waiting.factor;
    buffered.object = landmark.object;
    smoother.addObservation(waiting.pose, buffered);
  }
  landmark.run = landmark.taken = static_cast<int>(agreed.size());
  label.taken += landmark.taken;
  return &bestOf(label) == &landmark;
}

}  // namespace diorama
