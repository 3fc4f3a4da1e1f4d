// The incremental smoother against Ceres on the same graphs.
#include "mapper/chain_smoother.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "mapper/graph_solver.h"
#include "tests/mapper/synthetic_graph.h"

namespace diorama {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)

// How a graph's measurements come in.
struct Arrival {
  double late = 0;       // share of observations that come late,
  int delay_poses = 10;  // by so many poses
  int appears_at = 0;    // the last object is seen from here on
  SmootherOptions smoother = {};
  const char* kernel = "none";
  double scale_sigma = 0;         // of the odometry, when it is not known
  size_t other_scale_from = 100;  // another one from this pose on
};

class Feeder {
 public:
  Feeder(const SyntheticGraph& graph, const Arrival& arrival, uint64_t seed)
      : graph_(graph),
        arrival_(arrival),
        numbers_(seed),
        smoother(arrival.smoother, {*kernelFromString(arrival.kernel), 4.1}, {}) {}

  void feedAll() {
    for (size_t k = 0; k < graph_.truth.poses.size(); ++k) feed(k);
    for (const Held& held : held_) observe(held.pose, *held.measurement);
    held_.clear();
    smoother.update();
    smoother.sweep();
  }

 private:
  struct Held {
    size_t due, pose;
    const ObjectMeasurement* measurement;
  };

  void feed(size_t k) {
    const int64_t time = graph_.truth.poses[k].timestamp_ns;
    if (k == 0) smoother.start(time);
    if (k == 0 || k == arrival_.other_scale_from) beginScale();
    if (k > 0) smoother.addPose(time, step(k));
    for (const ObjectMeasurement& m : graph_.observations[k]) {
      const bool last = m.object.back() - '0' == static_cast<int>(graph_.objects.size()) - 1;
      if (last && static_cast<int>(k) < arrival_.appears_at) continue;
      if (numbers_.uniform(0, 1) < arrival_.late)
        held_.push_back({k + static_cast<size_t>(arrival_.delay_poses), k, &m});
      else
        observe(k, m);
    }
    while (!held_.empty() && held_.front().due <= k) {
      observe(held_.front().pose, *held_.front().measurement);
      held_.pop_front();
    }
    smoother.update();
  }

  // The first one before all objects.
  void beginScale() {
    if (arrival_.scale_sigma == 0) return;
    if (scale_) smoother.release(*scale_);
    scale_ = smoother.addScale(arrival_.scale_sigma);
    names_.push_back("a scale");
  }

  OdometryFactor step(size_t k) const {
    OdometryFactor factor = *makeOdometryFactor(graph_.odometry[k - 1], 1).factor;
    factor.scale = scale_;
    return factor;
  }

  void observe(size_t pose, const ObjectMeasurement& m) {
    auto found = std::find(names_.begin(), names_.end(), m.object);
    if (found == names_.end()) {
      smoother.addObject(m.object, smoother.T_world_camera(pose) * m.T_camera_object);
      found = names_.insert(names_.end(), m.object);
    }
    smoother.addObservation(
        pose, *makeObjectFactor(m, static_cast<size_t>(found - names_.begin()), 1).factor);
  }

  const SyntheticGraph& graph_;
  Arrival arrival_;
  Numbers numbers_;
  std::deque<Held> held_;
  std::vector<std::string> names_;
  std::optional<size_t> scale_;

 public:
  ChainSmoother smoother;
};

int relineariseToTheEnd(ChainSmoother& smoother) {
  int passes = 1;
  while (smoother.relinearise() > 1e-10 && passes < 30) ++passes;
  return passes;
}

void expectSameValues(const Graph& a, const Graph& b, double tolerance) {
  double worst_m = 0, worst_rad = 0;
  const auto compare = [&](const SE3& x, const SE3& y) {
    worst_m = std::max(worst_m, (x.translation - y.translation).norm());
    worst_rad = std::max(worst_rad, angleBetween(x.rotation, y.rotation));
  };
  for (size_t k = 0; k < a.poses.size(); ++k)
    compare(a.poses[k].T_world_camera, b.poses[k].T_world_camera);
  for (size_t j = 0; j < a.objects.size(); ++j)
    compare(a.objects[j].T_world_object, b.objects[j].T_world_object);
  std::printf("  poses off by %.2g m, %.2g rad\n", worst_m, worst_rad);
  EXPECT_LT(worst_m, tolerance);
  EXPECT_LT(worst_rad, tolerance);
}

// Largest difference of entries in units of the standard deviations.
double relativeDifference(const Eigen::MatrixXd& P, const Eigen::MatrixXd& expected) {
  const Eigen::VectorXd scale = expected.diagonal().cwiseSqrt().cwiseInverse();
  return (scale.asDiagonal() * (P - expected) * scale.asDiagonal()).cwiseAbs().maxCoeff();
}

void expectExact(const SyntheticGraph& graph, const Arrival& arrival, uint64_t seed) {
  Feeder feeder(graph, arrival, seed);
  feeder.feedAll();
  ChainSmoother& smoother = feeder.smoother;
  Graph batch = smoother.estimate();
  ASSERT_TRUE(solve(batch, 200).usable);
  const int passes = relineariseToTheEnd(smoother);
  const Graph chain = smoother.estimate();
  const double optimum = cost(batch);
  std::printf("  cost %.6f, Ceres %+.2g relative, %d passes\n", optimum,
              (cost(chain) - optimum) / optimum, passes);
  EXPECT_NEAR(cost(chain), optimum, 1e-6 * optimum);
  expectSameValues(chain, batch, 1e-6);
  if (std::string(arrival.kernel) != "none") return;
  const ChainSmoother::Joint joint = smoother.joint();
  const auto expected = jointCovariance(chain, joint.slots);
  ASSERT_TRUE(expected);
  const double off = relativeDifference(joint.P, *expected);
  std::printf("  joint covariance off by %.2g\n", off);
  EXPECT_LT(off, 1e-6);
}

struct Case {
  const char* name;
  SyntheticOptions graph;
  Arrival arrival;
};

std::vector<Case> cases() {
  const SyntheticOptions few{.poses = 130, .objects = 3, .visible = 0.5};
  SyntheticOptions gap{
      .poses = 240, .objects = 3, .visible = 0.6, .hidden_from = 60, .hidden_to = 180};
  SyntheticOptions drifting = gap;  // comes back with a large correction
  drifting.odometry_sigma_m = 2e-3;
  drifting.odometry_sigma_rad = 3e-3;
  SyntheticOptions many{.poses = 250, .objects = 8, .visible = 0.1};
  SmootherOptions tight;
  tight.active_objects = 3;
  tight.dormant_after_poses = 20;
  SmootherOptions restless;  // a pass over everything is always under way
  restless.window_poses = 8;
  restless.pass_poses = 3;
  restless.relinearise_m = restless.relinearise_rad = 1e-9;
  restless.relinearise_growth = 0;
  SmootherOptions restless_and_tight = restless;
  restless_and_tight.active_objects = 3;
  restless_and_tight.dormant_after_poses = 20;
  return {{"few", few, {}},
          {"a gap", gap, {}},
          {"a return after drift", drifting, {}},
          {"an object that appears late", few, {.appears_at = 90}},
          {"late measurements", few, {.late = 0.3}},
          {"measurements later than the window", few, {.late = 0.05, .delay_poses = 90}},
          {"objects that sleep", many, {.smoother = tight}},
          {"objects that sleep, late measurements", many, {.late = 0.2, .smoother = tight}},
          {"passes", drifting, {.smoother = restless}},
          {"passes, late measurements", few, {.late = 0.3, .delay_poses = 5, .smoother = restless}},
          {"passes, measurements later than the window", few, {.late = 0.05, .smoother = restless}},
          {"passes, an object that appears late", few, {.appears_at = 90, .smoother = restless}},
          {"passes, objects that sleep", many, {.late = 0.2, .smoother = restless_and_tight}},
          {"kernel", few, {.kernel = "cauchy_tail"}},
          {"scales", gap, {.scale_sigma = 0.05}},
          {"scales, passes", few, {.smoother = restless, .scale_sigma = 0.05}},
          {"scales, late measurements", few, {.late = 0.3, .scale_sigma = 0.02}},
          {"scales, objects that sleep", many, {.smoother = tight, .scale_sigma = 0.05}}};
}

TEST(ChainSmoother, EqualsCeresAfterFullPasses) {
  for (const Case& c : cases()) {
    for (uint64_t seed = 1; seed <= 2; ++seed) {
      std::printf("%s, seed %d\n", c.name, static_cast<int>(seed));
      SCOPED_TRACE(c.name);
      expectExact(makeGraph(c.graph, seed), c.arrival, seed);
    }
  }
}

// Before any full pass the newest pose is near the optimum already.
TEST(ChainSmoother, OnlineIsNearTheOptimum) {
  for (const Case& c : cases()) {
    const SyntheticGraph graph = makeGraph(c.graph, 4);
    Feeder feeder(graph, c.arrival, 4);
    feeder.feedAll();
    Graph batch = feeder.smoother.estimate();
    ASSERT_TRUE(solve(batch, 200).usable);
    const SE3 best = batch.poses.back().T_world_camera;
    const SE3 online = feeder.smoother.T_world_camera(batch.poses.size() - 1);
    std::printf("%s: %.4f mm, %.4f deg\n", c.name,
                1e3 * (online.translation - best.translation).norm(),
                57.3 * angleBetween(online.rotation, best.rotation));
    EXPECT_THAT(online, PoseNear(best, 2e-4, 5e-4)) << c.name;
  }
}

// A pass over everything takes the chain's place on its way: no pose is read in between that stands
// in charts of two kinds.
TEST(ChainSmoother, PassesGoOnBesideTheChainInUse) {
  SmootherOptions options;
  options.window_poses = 8;
  options.relinearise_m = options.relinearise_rad = 1e-9;
  options.relinearise_growth = 0;
  const SyntheticGraph graph = makeGraph({.poses = 300, .objects = 3, .visible = 0.6}, 8);
  options.pass_poses = 1000;  // in one go
  Feeder at_once(graph, {.smoother = options}, 1);
  options.pass_poses = 2;
  Feeder in_parts(graph, {.smoother = options}, 1);
  at_once.feedAll();
  in_parts.feedAll();
  for (size_t k = 0; k < 300; ++k)
    EXPECT_THAT(in_parts.smoother.T_world_camera(k),
                PoseNear(at_once.smoother.T_world_camera(k), 1e-5, 1e-5));
}

// A late measurement gives what it would have given in time.
TEST(ChainSmoother, LateMeasurementsAreAsGoodAsPunctualOnes) {
  const SyntheticGraph graph = makeGraph({.poses = 100, .objects = 2, .visible = 0.7}, 5);
  Feeder punctual(graph, {}, 1), late(graph, {.late = 1, .delay_poses = 8}, 1);
  punctual.feedAll();
  late.feedAll();
  relineariseToTheEnd(punctual.smoother);
  relineariseToTheEnd(late.smoother);
  EXPECT_THAT(late.smoother.T_world_camera(99),
              PoseNear(punctual.smoother.T_world_camera(99), 1e-9, 1e-9));
}

TEST(ChainSmoother, SleepingObjectsLeaveTheRootAndComeBack) {
  SyntheticGraph graph = makeGraph({.poses = 300, .objects = 6}, 6);
  // One object at a time; the first one again at the end.
  for (size_t k = 0; k < 300; ++k)
    std::erase_if(graph.observations[k], [&](const ObjectMeasurement& m) {
      return m.object != "object" + std::to_string(k < 250 ? k / 50 : 0);
    });
  Arrival arrival;
  arrival.smoother.active_objects = 2;
  arrival.smoother.dormant_after_poses = 10;
  Feeder feeder(graph, arrival, 1);
  feeder.feedAll();
  EXPECT_EQ(feeder.smoother.objectCount(), 5u);
  EXPECT_LE(feeder.smoother.joint().slots.size(), 3u);
  EXPECT_TRUE(feeder.smoother.isActive(0));
  EXPECT_FALSE(feeder.smoother.isActive(1));
  for (size_t j = 0; j < 5; ++j) {
    EXPECT_THAT(feeder.smoother.T_world_object(j), PoseNear(graph.objects[j], 4e-3, 0.02)) << j;
    EXPECT_TRUE(feeder.smoother.covarianceWith(j).object.allFinite());
  }
}

// What is taken out again has never been there.
TEST(ChainSmoother, RemovedObservationsLeaveNothing) {
  const SyntheticGraph whole = makeGraph({.poses = 300, .objects = 3, .visible = 0.6}, 8);
  for (const size_t from : {280u, 120u, 0u}) {
    SyntheticGraph rest = whole;
    for (size_t k = from; k < 300; ++k)
      std::erase_if(rest.observations[k],
                    [](const ObjectMeasurement& m) { return m.object == "object1"; });
    Feeder removed(whole, {}, 1), without(rest, {}, 1);
    removed.feedAll();
    without.feedAll();
    size_t object = 0;
    while (removed.smoother.estimate().objects[object].name != "object1") ++object;
    const size_t left = removed.smoother.removeObservations(object, from);
    EXPECT_EQ(left == 0, from == 0);
    EXPECT_EQ(removed.smoother.isActive(object), from > 0);
    for (ChainSmoother* smoother : {&removed.smoother, &without.smoother})
      for (int i = 0; i < 5; ++i) smoother->relinearise();
    EXPECT_THAT(removed.smoother.T_world_camera(299),
                PoseNear(without.smoother.T_world_camera(299), 1e-8, 1e-8));
    EXPECT_LT((removed.smoother.cameraCovariance() - without.smoother.cameraCovariance()).norm(),
              1e-6 * without.smoother.cameraCovariance().norm());
  }
}

// Between two solutions of the root the belief is carried on in covariance form.
TEST(ChainSmoother, CarriedBeliefEqualsTheSolvedOne) {
  const SyntheticGraph graph = makeGraph({.poses = 60, .objects = 3, .visible = 0.8}, 7);
  for (const double scale_sigma : {0.0, 0.05}) {
    Feeder feeder(graph, {.smoother = {.solve_every = 1}, .scale_sigma = scale_sigma}, 1);
    feeder.feedAll();
    ChainSmoother& smoother = feeder.smoother;
    OdometryFactor step = *makeOdometryFactor(graph.odometry.back(), 1).factor;
    if (scale_sigma > 0) step.scale = 0;
    smoother.addPose(graph.truth.poses.back().timestamp_ns + 1, step);
    const size_t first = scale_sigma > 0 ? 1 : 0;  // after the scale
    for (const ObjectMeasurement& m : graph.observations.back())
      smoother.addObservation(
          smoother.poseCount() - 1,
          *makeObjectFactor(m, first + static_cast<size_t>(m.object.back() - '0'), 1).factor);
    const ChainSmoother::Joint carried = smoother.joint();
    const SE3 camera = smoother.T_world_camera(smoother.poseCount() - 1);
    smoother.update();
    EXPECT_THAT(smoother.T_world_camera(smoother.poseCount() - 1), PoseNear(camera, 1e-6, 1e-6));
    EXPECT_LT(relativeDifference(carried.P, smoother.joint().P), 1e-3);
  }
}

// Steps that are 3% too short, and objects that are seen from a long way: the scale comes out.
TEST(ChainSmoother, FindsTheScaleOfTheOdometry) {
  SyntheticGraph graph = makeGraph({.poses = 300, .objects = 2}, 9);
  for (OdometryMeasurement& step : graph.odometry) step.T_from_to.translation *= 0.97;
  Feeder feeder(graph, {.scale_sigma = 0.05, .other_scale_from = 1000}, 1);
  feeder.feedAll();
  const double sigma = std::sqrt(feeder.smoother.objectCovariance(0)(0, 0));
  EXPECT_LT(sigma, 1e-3);
  EXPECT_NEAR(feeder.smoother.logScale(0), -std::log(0.97), 4 * sigma);
  for (size_t j = 0; j < 2; ++j)
    EXPECT_THAT(feeder.smoother.T_world_object(j + 1), PoseNear(graph.objects[j], 2e-3, 5e-3));
}

}  // namespace
}  // namespace diorama
