// Measurements that are wrong in the ways trackers are: somewhere at random, for a while on
// something else that stands still, or turned over.
#pragma once

#include <numbers>
#include <vector>

#include "tests/mapper/synthetic_graph.h"

namespace diorama::test {

enum class Wrong { kRandom, kClutter, kFlipped };

inline SE3 flip() {
  return {Eigen::Quaterniond(0, 0, 0, 1), Vector3d::Zero()};  // 180 degrees about z
}

inline Vector3d direction(Numbers& numbers) {
  return Vector3d(numbers.normal(), numbers.normal(), numbers.normal()).normalized();
}

// Somewhere in the view.
inline SE3 randomView(Numbers& numbers) {
  const double z = numbers.uniform(0.5, 2);
  const SE3 turned = numbers.pose(0);
  return {turned.rotation, {0.4 * z * numbers.uniform(-1, 1), 0.4 * z * numbers.uniform(-1, 1), z}};
}

// 5 to 30 cm and 20 to 180 degrees beside the object.
inline SE3 besideObject(const SE3& T_world_object, Numbers& numbers) {
  Vector6d xi;
  xi << numbers.uniform(0.05, 0.3) * direction(numbers),
      numbers.uniform(20, 180) / 180 * std::numbers::pi * direction(numbers);
  return T_world_object * exp(xi);
}

// Makes a share of an object's measurements wrong; bursts last 30 frames on average. Returns which.
inline std::vector<std::vector<bool>> makeWrong(SyntheticGraph& graph, Wrong kind, double share,
                                                uint64_t seed) {
  constexpr double burst = 30;
  Numbers numbers(7919 * seed + 13);
  const size_t objects = graph.objects.size();
  std::vector<bool> off(objects);
  std::vector<SE3> place(objects);
  const auto begin = [&](size_t j) {
    off[j] = true;
    place[j] = kind == Wrong::kFlipped ? graph.objects[j] * flip()
                                       : besideObject(graph.objects[j], numbers);
  };
  for (size_t j = 0; j < objects; ++j)
    if (numbers.uniform(0, 1) < share) begin(j);
  std::vector<std::vector<bool>> wrong(graph.observations.size());
  for (size_t k = 0; k < graph.observations.size(); ++k) {
    for (size_t j = 0; j < objects; ++j) {
      if (off[j] && numbers.uniform(0, 1) < 1 / burst)
        off[j] = false;
      else if (!off[j] && numbers.uniform(0, 1) < share / (1 - share) / burst)
        begin(j);
    }
    for (ObjectMeasurement& m : graph.observations[k]) {
      const auto j = static_cast<size_t>(m.object.back() - '0');
      const bool bad = kind == Wrong::kRandom ? numbers.uniform(0, 1) < share : off[j];
      wrong[k].push_back(bad);
      if (!bad) continue;
      m.T_camera_object = kind == Wrong::kRandom ? randomView(numbers)
                                                 : disturbed(graph.camera(k).inverse() * place[j],
                                                             m.covariance, numbers, true);
    }
  }
  return wrong;
}

}  // namespace diorama::test
