// One step of the map with five objects, of which 60% are measured in each frame: odometry, gate,
// smoothing, joint covariance. The trajectory is as long as the name says when timing begins.
// Beside it one iteration of Ceres over the same graph, with the same covariance, and a whole run
// step by step: whether time and memory stay flat, and how long the longest steps are.
#include <benchmark/benchmark.h>
#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <numeric>

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

// Heap in use; the measurements are made anew for each step and count for nothing. (The size of the
// process would count what earlier benchmarks left behind, and not what they made room for.)
double memoryKb() {
  const struct mallinfo2 info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd) / 1024;
}

void BM_SmootherStep(benchmark::State& state) {
  const int poses = static_cast<int>(state.range(0));
  const Orbit orbit;
  const double before = memoryKb();
  Mapper mapper;
  for (int k = 0; k < poses; ++k)
    step(mapper, k, k ? std::optional(orbit.odometry(k)) : std::nullopt, orbit.objects(k));
  state.counters["kB_per_pose"] = (memoryKb() - before) / poses;
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

double cpuMs() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

// Slope of a line through the values, in percent of their mean.
double slopePercent(const std::vector<double>& values) {
  const double n = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  double xy = 0, xx = 0;
  for (size_t i = 0; i < values.size(); ++i) {
    const double x = static_cast<double>(i) - (n - 1) / 2;
    xy += x * (values[i] - mean);
    xx += x * x;
  }
  return 100 * xy / xx / mean;
}

// A run from its first step on. Slopes are by 1000 steps, the first 1000 left out, of the mean time
// of a step and of the memory that 1000 poses add.
void BM_SmootherRun(benchmark::State& state) {
  constexpr int kBlock = 1000;
  const int poses = static_cast<int>(state.range(0));
  const Orbit orbit;
  for (auto _ : state) {
    std::vector<double> times, block_times, block_memory;
    times.reserve(static_cast<size_t>(poses));
    const double before = memoryKb();
    double last_memory = before;
    Mapper mapper;
    for (int k = 0; k < poses; ++k) {
      const auto odometry = k ? std::optional(orbit.odometry(k)) : std::nullopt;
      const auto objects = orbit.objects(k);
      const double start = cpuMs();
      step(mapper, k, odometry, objects);
      times.push_back(cpuMs() - start);
      if ((k + 1) % kBlock != 0) continue;
      const double memory = memoryKb();
      if (k + 1 > kBlock) {
        block_times.push_back(std::accumulate(times.end() - kBlock, times.end(), 0.0) / kBlock);
        block_memory.push_back(memory - last_memory);
      }
      last_memory = memory;
    }
    state.counters["kB_per_pose"] = (memoryKb() - before) / poses;
    state.counters["time_slope_%"] = slopePercent(block_times);
    state.counters["memory_slope_%"] = slopePercent(block_memory);
    std::sort(times.begin(), times.end());
    const auto quantile = [&](double q) {
      return times[static_cast<size_t>(q * static_cast<double>(times.size() - 1))];
    };
    state.counters["median_ms"] = quantile(0.5);
    state.counters["p99.9_ms"] = quantile(0.999);
    state.counters["max_ms"] = times.back();
  }
}

BENCHMARK(BM_SmootherRun)->Arg(20000)->Iterations(1)->Unit(benchmark::kMillisecond);

Graph graphOf(const Orbit& orbit, int poses) {
  Graph graph;
  graph.objects.resize(kObjects);
  for (int k = 0; k < poses; ++k) {
    PoseNode pose{SE3{}, Orbit::time(k), {}};
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
