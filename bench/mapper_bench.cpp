// One step of the map with five objects, of which 60% are measured in each frame: odometry, gate,
// smoothing, joint covariance. The trajectory is as long as the name says when timing begins.
// Beside it one iteration of Ceres over the same graph, with the same covariance.
#include <benchmark/benchmark.h>
#include <sys/resource.h>

#include <cmath>

#include "core/random.h"
#include "mapper/graph_solver.h"
#include "mapper/mapper.h"

namespace diorama {
namespace {

constexpr int kObjects = 5;

class Orbit {
 public:
  OdometryMeasurement odometry(int k) const {
    const SE3 motion = camera(k - 1).inverse() * camera(k);
    return {"bench", time(k - 1), time(k), motion * noise(k, 0, 4e-3, 2e-3), P(4e-3, 2e-3), 1};
  }

  std::vector<ObjectMeasurement> objects(int k) const {
    std::vector<ObjectMeasurement> seen;
    for (int j = 0; j < kObjects; ++j) {
      const uint64_t index = static_cast<uint64_t>(10 + 4 * j);
      if (random_.uniform(static_cast<uint32_t>(k), index)[0] > 0.6) continue;
      const SE3 T_world_object{expSO3({0, 0, 1.0 * j}), {0.2 * j - 0.4, 0.1 * (j % 2), 0}};
      const SE3 T_camera_object = camera(k).inverse() * T_world_object;
      seen.push_back({"bench", "object" + std::to_string(j), time(k),
                      T_camera_object * noise(k, index + 1, 8e-3, 2e-2), P(8e-3, 2e-2), 1, true,
                      ""});
    }
    return seen;
  }

  static int64_t time(int k) { return k * int64_t{33'333'333}; }

 private:
  static SE3 camera(int k) {
    const double a = 2 * M_PI * k / 600, b = 2 * M_PI * k / 1370, r = 1.3 + 0.3 * std::sin(b);
    const Vector3d position(r * std::cos(a), r * std::sin(a), 0.9 + 0.25 * std::sin(2 * b));
    const Vector3d z = -position.normalized(), x = z.cross(Vector3d::UnitZ()).normalized();
    Matrix3d R;
    R << x, z.cross(x), z;
    return {Eigen::Quaterniond(R), position};
  }
  SE3 noise(int k, uint64_t index, double sigma_m, double sigma_rad) const {
    const auto a = random_.normal(static_cast<uint32_t>(k), index);
    const auto b = random_.normal(static_cast<uint32_t>(k), index + 1);
    Vector6d xi;
    xi << sigma_m * Vector3d(a[0], a[1], a[2]), sigma_rad * Vector3d(b[0], b[1], b[2]);
    return exp(xi);
  }
  static Matrix6d P(double sigma_m, double sigma_rad) {
    Vector6d variances;
    variances << Vector3d::Constant(sigma_m * sigma_m), Vector3d::Constant(sigma_rad * sigma_rad);
    return variances.asDiagonal();
  }

  Random random_{1, RandomStream::kTest};
};

void step(Mapper& mapper, int k, const std::optional<OdometryMeasurement>& odometry,
          const std::vector<ObjectMeasurement>& objects) {
  AddResult result;
  if (odometry)
    result = mapper.addOdometry(*odometry);
  else
    mapper.start(Orbit::time(k));
  for (const ObjectMeasurement& m : objects) result = mapper.addObject(m);
  benchmark::DoNotOptimize(mapper.update());
}

double memoryMb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

void BM_SmootherStep(benchmark::State& state) {
  const int poses = static_cast<int>(state.range(0));
  const Orbit orbit;
  const double before = memoryMb();
  Mapper mapper;
  for (int k = 0; k < poses; ++k)
    step(mapper, k, k ? std::optional(orbit.odometry(k)) : std::nullopt, orbit.objects(k));
  state.counters["kB_per_pose"] = 1024 * (memoryMb() - before) / poses;
  int k = poses;
  for (auto _ : state) {
    state.PauseTiming();
    const OdometryMeasurement odometry = orbit.odometry(k);
    const std::vector<ObjectMeasurement> objects = orbit.objects(k);
    state.ResumeTiming();
    step(mapper, k++, odometry, objects);
  }
}

BENCHMARK(BM_SmootherStep)
    ->Arg(1000)
    ->Arg(5000)
    ->Arg(20000)
    ->Iterations(1000)
    ->Unit(benchmark::kMillisecond);

Graph graphOf(const Orbit& orbit, int poses) {
  Graph graph;
  graph.objects.resize(kObjects);
  for (int k = 0; k < poses; ++k) {
    PoseNode pose{Orbit::time(k), SE3{}, {}};
    if (k > 0) {
      graph.odometry.push_back(*makeOdometryFactor(orbit.odometry(k), 1).factor);
      pose.T_world_camera = graph.poses.back().T_world_camera * graph.odometry.back().Z;
    }
    for (const ObjectMeasurement& m : orbit.objects(k)) {
      const auto j = static_cast<size_t>(m.object.back() - '0');
      if (graph.objects[j].name.empty())
        graph.objects[j] = {m.object, pose.T_world_camera * m.T_camera_object};
      pose.objects.push_back(*makeObjectFactor(m, j, 1).factor);
    }
    graph.poses.push_back(std::move(pose));
  }
  return graph;
}

void BM_CeresStep(benchmark::State& state) {
  Graph graph = graphOf(Orbit(), static_cast<int>(state.range(0)));
  solve(graph, 20);
  for (auto _ : state) {
    benchmark::DoNotOptimize(solve(graph, 1));
    benchmark::DoNotOptimize(jointCovariance(graph, {0, 1, 2, 3, 4}));
  }
}

BENCHMARK(BM_CeresStep)->Arg(1000)->Arg(5000)->Iterations(3)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace diorama
