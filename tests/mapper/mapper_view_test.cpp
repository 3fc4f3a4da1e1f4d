// What the map says of an object in the newest frame: its belief, joined with that frame's
// measurement.
#include <gtest/gtest.h>

#include "mapper/present_view.h"
#include "tests/mapper/synthetic_graph.h"

namespace diorama {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)

constexpr const char* kObject = "object0";

MapperOptions slowErrors() {
  MapperOptions options;
  options.object_sigma_scale = 6;
  return options;
}

TEST(MapperView, IsTheBeliefJoinedWithTheMeasurementAsItCame) {
  const SyntheticGraph graph = makeGraph({.poses = 60}, 1);
  Mapper mapper(slowErrors());
  feedAll(mapper, graph);
  const ObjectMeasurement& seen = graph.observations.back().front();
  const ObjectPrediction believed = mapper.predict(kObject).value();
  const ObjectPrediction view = mapper.view(kObject).value();
  const ObjectPrediction expected =
      joinMeasurement(believed, seen.T_camera_object, seen.covariance, GateOptions{}.chi_square);
  EXPECT_THAT(view.T_camera_object, PoseNear(expected.T_camera_object, 1e-9, 1e-9));
  EXPECT_THAT(view.covariance, MatrixNear(expected.covariance, 1e-12));
  EXPECT_GT((view.T_camera_object.translation - believed.T_camera_object.translation).norm(), 1e-6);
}

TEST(MapperView, IsTheBeliefWhereNothingWasMeasuredOrAccepted) {
  SyntheticGraph graph = makeGraph({.poses = 62}, 2);
  graph.observations[60].clear();
  ObjectMeasurement& wrong = graph.observations[61].front();
  wrong.T_camera_object.translation.x() += 0.3;
  Mapper mapper(slowErrors());
  EXPECT_FALSE(mapper.view(kObject));
  for (size_t k = 0; k < graph.truth.poses.size(); ++k) {
    feed(mapper, graph, k);
    if (k < 60) continue;
    EXPECT_THAT(mapper.view(kObject)->T_camera_object,
                PoseNear(mapper.predict(kObject)->T_camera_object, 1e-12, 1e-12))
        << k;
  }
  EXPECT_FALSE(mapper.view("object1"));
}

// A measurement that looks the same after half a turn is joined as the same, not half way round.
TEST(MapperView, OfASymmetricObjectTakesTheNearestOfEqualPoses) {
  SyntheticGraph graph = makeGraph({.poses = 61}, 3);
  const SE3 half_turn{expSO3({0, 0, 3.14159265358979}), Vector3d::Zero()};
  ObjectMeasurement& last = graph.observations.back().front();
  last.T_camera_object = last.T_camera_object * half_turn;
  Symmetries symmetries;
  symmetries.discrete.push_back(half_turn);
  Mapper mapper(slowErrors());
  mapper.setSymmetries(kObject, symmetries);
  feedAll(mapper, graph);
  EXPECT_THAT(mapper.view(kObject)->T_camera_object,
              PoseNear(graph.camera(60).inverse() * graph.objects[0], 3e-3, 0.01));
}

// A measurement that comes late belongs to a frame that is past.
TEST(MapperView, DoesNotTakeALateMeasurementForThisFrame) {
  const SyntheticGraph graph = makeGraph({.poses = 60}, 4);
  Mapper mapper(slowErrors());
  for (size_t k = 0; k < 59; ++k) feed(mapper, graph, k);
  ASSERT_TRUE(mapper.addOdometry(graph.odometry[58]));
  ObjectMeasurement late = graph.observations[58].front();
  ASSERT_TRUE(mapper.addObject(late));
  mapper.update();
  EXPECT_THAT(mapper.view(kObject)->T_camera_object,
              PoseNear(mapper.predict(kObject)->T_camera_object, 1e-12, 1e-12));
}

}  // namespace
}  // namespace diorama
