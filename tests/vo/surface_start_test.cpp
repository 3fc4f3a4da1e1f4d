// Starts of a camera that only turns, from the surface of a known object.
#include "vo/surface_start.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/matchers.h"
#include "tests/vo/textured_room.h"
#include "vo/odometry.h"

namespace diorama {
namespace {

using test::TexturedRoom;

KnownShapes shapes() { return {std::make_shared<test::RoomPillar>(), {"thing"}}; }

// It turns for two seconds, and goes sideways in the third.
SE3 pathAt(int frame) {
  const double turn_rad = 0.12 * std::sin(0.13 * frame);
  const double moved_m = frame < 60 ? 0 : 0.006 * (frame - 60);
  return {expSO3(Vector3d(0.3 * turn_rad, turn_rad, 0)), Vector3d(-0.15 + moved_m, 0, -0.2)};
}

struct Played {
  int start = -1;
  SE3 T_start_now;
  int unhealthy = 0;
  std::string said;
};

// `object_at`: where the object is said to be in the world.
template <class Path, class ObjectAt>
Played play(const Path& path, const ObjectAt& object_at, int frames, KnownShapes known) {
  const TexturedRoom room;
  VisualOdometry odometry(room.camera, {}, "vo", std::move(known));
  Played played;
  for (int k = 0; k < frames; ++k) {
    const auto step = odometry.track(room.draw(path(k), k));
    const std::vector<ObjectMeasurement> told{room.measureObject(path(k), k, object_at(k))};
    odometry.update(std::span(told).first(odometry.wantsObjects() ? 1 : 0));
    for (const OdometryEvent& event : odometry.events()) played.said += event.reason + "; ";
    if (step) played.T_start_now = played.T_start_now * step->T_from_to;
    played.unhealthy += step && step->health <= 0;
    if (odometry.started() && played.start < 0) played.start = k;
  }
  return played;
}

SE3 atRest(int) { return TexturedRoom::poseOfObject(); }

TEST(SurfaceStart, ACameraThatOnlyTurnsStartsFromAnObjectAndIsMetricWhenItMoves) {
  for (const int frames : {59, 90}) {
    const Played played = play(pathAt, atRest, frames, shapes());
    ASSERT_GE(played.start, 0) << played.said;
    EXPECT_LE(played.start, 54);  // after 45 frames of following it, and the trial
    EXPECT_NE(played.said.find("surface of thing"), std::string::npos) << played.said;
    EXPECT_EQ(played.unhealthy, 0);
    const SE3 truth = pathAt(played.start).inverse() * pathAt(frames - 1);
    EXPECT_THAT(played.T_start_now, test::PoseNear(truth, 0.006, 0.006)) << frames;
  }
}

TEST(SurfaceStart, WithoutShapesThereIsNone) { EXPECT_LT(play(pathAt, atRest, 59, {}).start, 0); }

TEST(SurfaceStart, ACameraAtRestDoesNotTellWhetherTheObjectRests) {
  const auto rest = [](int) { return pathAt(0); };
  EXPECT_LT(play(rest, atRest, 100, shapes()).start, 0);
}

TEST(SurfaceStart, AnObjectThatMovesItselfIsNoStart) {
  const auto pushed = [](int k) {
    return SE3{Eigen::Quaterniond::Identity(), Vector3d(0.004 * k, 0.002 * k, 0)} *
           TexturedRoom::poseOfObject();
  };
  EXPECT_LT(play(pathAt, pushed, 59, shapes()).start, 0);
}

}  // namespace
}  // namespace diorama
