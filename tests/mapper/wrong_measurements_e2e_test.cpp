// Wrong measurements do no harm to the map.
#include <gtest/gtest.h>

#include "mapper/mapper.h"
#include "tests/mapper/wrong_measurements.h"

namespace diorama {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)

constexpr double kDegree = 3.14159265358979323846 / 180;

// How many of the objects end within 3 cm and 5 degrees.
int goodObjects(Wrong kind, double share, uint64_t seed, bool symmetric) {
  SyntheticGraph graph = makeGraph(coarse(), seed);
  makeWrong(graph, kind, share, seed);
  Mapper mapper;
  if (symmetric)
    for (const char* name : {"object0", "object1", "object2", "object3", "object4"})
      mapper.setSymmetries(name, {{flip()}, std::nullopt});
  for (size_t k = 0; k < graph.truth.poses.size(); ++k) {
    if (k == 0) mapper.start(graph.truth.poses[0].timestamp_ns);
    if (k > 0) {
      EXPECT_TRUE(mapper.addOdometry(graph.odometry[k - 1]));
    }
    for (const ObjectMeasurement& m : graph.observations[k]) static_cast<void>(mapper.addObject(m));
    mapper.update();
  }
  int good = 0;
  for (const ObjectEstimate& object : mapper.finish().objects) {
    const SE3& truth = graph.objects[static_cast<size_t>(object.name.back() - '0')];
    const auto near = [&](const SE3& T) {
      return (object.T_world_object.translation - T.translation).norm() < 0.03 &&
             angleBetween(object.T_world_object.rotation, T.rotation) < 5 * kDegree;
    };
    good += near(truth) || (symmetric && near(truth * flip()));
  }
  return good;
}

struct Bar {
  const char* name;
  Wrong kind;
  bool symmetric;
  int at50, at70, at90;  // of 25 objects
};

TEST(WrongMeasurements, DoNoHarm) {
  for (const Bar& bar : {Bar{"random", Wrong::kRandom, false, 25, 25, 25},
                         Bar{"clutter", Wrong::kClutter, false, 25, 23, 11},
                         Bar{"flipped", Wrong::kFlipped, false, 11, 0, 0},
                         Bar{"flipped, symmetry declared", Wrong::kFlipped, true, 25, 25, 25}}) {
    int good[3] = {0, 0, 0};
    const double shares[3] = {0.5, 0.7, 0.9};
    for (int i = 0; i < 3; ++i)
      for (uint64_t seed = 1; seed <= 5; ++seed)
        good[i] += goodObjects(bar.kind, shares[i], seed, bar.symmetric);
    std::printf("wrong 50/70/90%%, %s: %d/%d/%d of 25 good\n", bar.name, good[0], good[1], good[2]);
    EXPECT_GE(good[0], bar.at50) << bar.name;
    EXPECT_GE(good[1], bar.at70) << bar.name;
    EXPECT_GE(good[2], bar.at90) << bar.name;
  }
}

}  // namespace
}  // namespace diorama
