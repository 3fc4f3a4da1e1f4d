// Cubic splines with knots at the keyframes' times (B-spline form), for positions and rotations.
#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <utility>

#include "core/errors.h"
#include "sim/motion_path.h"

namespace diorama {
namespace {

using Eigen::Quaterniond;

// The four cubic B-splines that are not zero at a time, and the first one's number.
struct Basis {
  size_t first = 0;
  std::array<double, 4> weight{};
};

// What a spline does at its ends: natural ones go on straight, others begin or end at rest.
struct Ends {
  bool rests_before = false, rests_after = false;
};

// n >= 2 sites make n + 2 B-splines; site i is knot i + 3. The three knots beyond each end continue
// the spacing of the last interval.
class Knots {
 public:
  Knots(const std::vector<double>& sites, Ends ends) : sites_(sites), ends_(ends) {
    const size_t n = sites.size();
    for (int k = 3; k > 0; --k) u_.push_back(sites[0] - k * (sites[1] - sites[0]));
    u_.insert(u_.end(), sites.begin(), sites.end());
    for (int k = 1; k <= 3; ++k) u_.push_back(sites[n - 1] + k * (sites[n - 1] - sites[n - 2]));
  }

  size_t siteCount() const { return sites_.size(); }
  const std::vector<double>& sites() const { return sites_; }

  // Cox-de Boor recursion; the time is clamped to the sites.
  Basis basis(double time) const {
    const double t = std::clamp(time, sites_.front(), sites_.back());
    const auto after = std::upper_bound(sites_.begin() + 1, sites_.end() - 1, t);
    const size_t i = static_cast<size_t>(after - sites_.begin()) - 1;
    Basis basis{i, {1, 0, 0, 0}};
    for (size_t degree = 1; degree <= 3; ++degree) {
      double saved = 0;
      for (size_t r = 0; r < degree; ++r) {
        const double right = u_[i + 4 + r], left = u_[i + 4 + r - degree];
        const double share = basis.weight[r] / (right - left);
        basis.weight[r] = saved + (right - t) * share;
        saved = (t - left) * share;
      }
      basis.weight[degree] = saved;
    }
    return basis;
  }

  // No second derivative at the first (last) site means that the outermost control difference is
  // this many times the next one; no first derivative, where it rests, that it is minus as many:
  // the first two intervals of knots are alike there.
  double startRatio() const {
    return (ends_.rests_before ? -1 : 1) * (u_[4] - u_[1]) / (u_[5] - u_[2]);
  }
  double endRatio() const {
    const size_t k = sites_.size() + 2;
    return (ends_.rests_after ? -1 : 1) * (u_[k + 2] - u_[k - 1]) / (u_[k + 1] - u_[k - 2]);
  }

 private:
  std::vector<double> sites_, u_;
  Ends ends_;
};

// Solves for the inner control values of a natural spline that has the given values at the sites:
// one tridiagonal system (Thomas algorithm).
std::vector<Vector3d> solveNatural(const Knots& knots, std::vector<Vector3d> values) {
  const size_t n = knots.siteCount();
  std::vector<std::array<double, 3>> row(n);
  for (size_t i = 0; i < n; ++i) {
    const Basis b = knots.basis(knots.sites()[i]);
    const size_t shift = i - b.first;  // 1 at the last site, 0 elsewhere
    row[i] = {b.weight[shift], b.weight[shift + 1], b.weight[shift + 2]};
  }
  const double start = knots.startRatio(), end = knots.endRatio();
  row[0] = {0, row[0][1] + row[0][0] * (1 + start), row[0][2] - row[0][0] * start};
  auto& last = row[n - 1];
  last = {last[0] - last[2] * end, last[1] + last[2] * (1 + end), 0};
  for (size_t i = 1; i < n; ++i) {
    const double factor = row[i][0] / row[i - 1][1];
    row[i][1] -= factor * row[i - 1][2];
    values[i] -= factor * values[i - 1];
  }
  values[n - 1] /= row[n - 1][1];
  for (size_t i = n - 1; i-- > 0;) values[i] = (values[i] - row[i][2] * values[i + 1]) / row[i][1];
  return values;
}

class PositionSpline {
 public:
  PositionSpline(const Knots& knots, const std::vector<Vector3d>& positions) : knots_(knots) {
    const std::vector<Vector3d> inner = solveNatural(knots, positions);
    const size_t n = inner.size();
    control_.push_back(inner[0] - knots.startRatio() * (inner[1] - inner[0]));
    control_.insert(control_.end(), inner.begin(), inner.end());
    control_.push_back(inner[n - 1] + knots.endRatio() * (inner[n - 1] - inner[n - 2]));
  }

  Vector3d at(double time) const {
    const Basis b = knots_.basis(time);
    Vector3d p = Vector3d::Zero();
    for (size_t k = 0; k < 4; ++k) p += b.weight[k] * control_[b.first + k];
    return p;
  }

 private:
  Knots knots_;
  std::vector<Vector3d> control_;
};

class RotationSpline {
 public:
  RotationSpline(const Knots& knots, const std::vector<Quaterniond>& rotations)
      : knots_(knots), inner_(rotations) {
    solve(rotations);
  }

  double error() const { return error_; }  // largest miss of a keyframe, rad

  Quaterniond at(double time) const {
    const Basis b = knots_.basis(time);
    Quaterniond q = control_[b.first];
    double cumulative = 1 - b.weight[0];
    for (size_t k = 1; k < 4; ++k) {
      q = q * expSO3(cumulative * difference_[b.first + k - 1]);
      cumulative -= b.weight[k];
    }
    return q.normalized();
  }

 private:
  // Newton's iteration with the Jacobian of the commutative case: each round solves for the control
  // changes that would remove the misses if rotations were vectors.
  void solve(const std::vector<Quaterniond>& rotations) {
    constexpr int kMaxRounds = 60;
    std::vector<Quaterniond> best = inner_;
    double best_error = 1e300;
    for (int round = 0; round < kMaxRounds; ++round) {
      placeEnds();
      error_ = 0;
      std::vector<Vector3d> miss;
      for (size_t i = 0; i < rotations.size(); ++i) {
        miss.push_back(logSO3(at(knots_.sites()[i]).conjugate() * rotations[i]));
        error_ = std::max(error_, miss.back().norm());
      }
      if (error_ < best_error) best_error = error_, best = inner_;
      if (error_ < 1e-14 || error_ > 4 * best_error + 1e-12) break;
      const std::vector<Vector3d> change = solveNatural(knots_, miss);
      for (size_t i = 0; i < inner_.size(); ++i)
        inner_[i] = (inner_[i] * expSO3(change[i])).normalized();
    }
    inner_ = best;
    error_ = best_error;
    placeEnds();
  }

  void placeEnds() {
    const size_t n = inner_.size();
    const Vector3d first = logSO3(inner_[0].conjugate() * inner_[1]);
    const Vector3d last = logSO3(inner_[n - 2].conjugate() * inner_[n - 1]);
    control_.assign(1, inner_[0] * expSO3(-knots_.startRatio() * first));
    control_.insert(control_.end(), inner_.begin(), inner_.end());
    control_.push_back(inner_[n - 1] * expSO3(knots_.endRatio() * last));
    difference_.assign(1, knots_.startRatio() * first);
    for (size_t i = 0; i + 1 < n; ++i)
      difference_.push_back(logSO3(inner_[i].conjugate() * inner_[i + 1]));
    difference_.push_back(knots_.endRatio() * last);
  }

  Knots knots_;
  std::vector<Quaterniond> inner_;    // control rotations, one per site
  std::vector<Quaterniond> control_;  // with one more at each end
  std::vector<Vector3d> difference_;  // from each control rotation to the next
  double error_ = 0;
};

// Keyframes that turn far from one to the next may have no solution near them; with rotations half
// way between added there is one.
RotationSpline fitRotations(std::vector<double> times, std::vector<Quaterniond> rotations,
                            Ends ends) {
  constexpr double kExact = 1e-10;  // rad
  constexpr int kMaxRefinements = 4;
  for (int refinement = 0;; ++refinement) {
    RotationSpline spline(Knots(times, ends), rotations);
    if (spline.error() < kExact || refinement == kMaxRefinements) return spline;
    std::vector<double> finer_times;
    std::vector<Quaterniond> finer;
    for (size_t i = 0; i + 1 < times.size(); ++i) {
      finer_times.insert(finer_times.end(), {times[i], (times[i] + times[i + 1]) / 2});
      finer.insert(finer.end(), {rotations[i], rotations[i].slerp(0.5, rotations[i + 1])});
    }
    finer_times.push_back(times.back());
    finer.push_back(rotations.back());
    times = std::move(finer_times);
    rotations = std::move(finer);
  }
}

class SplinePath : public MotionPath {
 public:
  SplinePath(PositionSpline position, RotationSpline rotation)
      : position_(std::move(position)), rotation_(std::move(rotation)) {}
  SE3 pose(double time_s) const override { return {rotation_.at(time_s), position_.at(time_s)}; }

 private:
  PositionSpline position_;
  RotationSpline rotation_;
};

class RestingPath : public MotionPath {
 public:
  explicit RestingPath(const SE3& pose) : pose_(pose) {}
  SE3 pose(double) const override { return pose_; }

 private:
  SE3 pose_;
};

// One path after the other: each until its time.
class PathsInTurn : public MotionPath {
 public:
  void add(double until_s, std::unique_ptr<MotionPath> path) {
    paths_.emplace_back(until_s, std::move(path));
  }
  SE3 pose(double time_s) const override {
    for (const auto& [until_s, path] : paths_)
      if (time_s < until_s) return path->pose(time_s);
    return paths_.back().second->pose(time_s);
  }

 private:
  std::vector<std::pair<double, std::unique_ptr<MotionPath>>> paths_;
};

std::unique_ptr<MotionPath> makeMovingPath(std::span<const Keyframe> keyframes, Ends ends) {
  std::vector<double> times;
  std::vector<Vector3d> positions;
  std::vector<Quaterniond> rotations;
  for (const Keyframe& keyframe : keyframes) {
    times.push_back(keyframe.time_s);
    positions.push_back(keyframe.pose.translation);
    rotations.push_back(keyframe.pose.rotation.normalized());
  }
  return std::make_unique<SplinePath>(PositionSpline(Knots(times, ends), positions),
                                      fitRotations(times, rotations, ends));
}

}  // namespace

std::unique_ptr<MotionPath> makeSplinePath(const std::vector<Keyframe>& keyframes) {
  DIORAMA_CHECK(!keyframes.empty());
  for (size_t i = 1; i < keyframes.size(); ++i)
    DIORAMA_CHECK(keyframes[i].time_s > keyframes[i - 1].time_s);
  const size_t last = keyframes.size() - 1;
  const auto restsAfter = [&](size_t i) {
    return i < last && keyframes[i].pose == keyframes[i + 1].pose;
  };
  auto path = std::make_unique<PathsInTurn>();
  for (size_t first = 0; first < last;) {
    size_t end = first + 1;
    const bool rests = restsAfter(first);
    while (end < last && restsAfter(end) == rests) ++end;
    path->add(keyframes[end].time_s,
              rests ? std::make_unique<RestingPath>(keyframes[first].pose)
                    : makeMovingPath(std::span(keyframes).subspan(first, end - first + 1),
                                     {first > 0, end < last}));
    first = end;
  }
  if (last == 0) path->add(0, std::make_unique<RestingPath>(keyframes[0].pose));
  return path;
}

}  // namespace diorama
