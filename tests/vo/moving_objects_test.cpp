// Objects that are known to move in the world are left out of the map.
#include "vo/moving_objects.h"

#include <gtest/gtest.h>

#include "tests/vo/textured_room.h"
#include "vo/odometry.h"

namespace diorama {
namespace {

using test::TexturedRoom;

constexpr int kPushedAt = 45;

Vector3d push(int frame) { return 0.004 * std::max(0, frame - kPushedAt) * Vector3d(1, 0, 0.3); }

// Near the pillar, which fills more than half of the view.
SE3 pathAt(int frame) {
  SE3 T = TexturedRoom::path(frame);
  T.translation += Vector3d(-0.2, 0, 0.35);
  return T;
}

struct Played {
  double error_m = 0;  // of the way, at its worst; of healthy steps from the push on
  int far_off = 0;     // healthy steps that end more than 3 cm away
};

Played play(bool told) {
  TexturedRoom room;
  VisualOdometry odometry(room.camera, {}, "vo", {std::make_shared<test::RoomPillar>(), {"thing"}});
  Played played;
  SE3 T_start_now;
  int start = -1;
  for (int k = 0; k < 120; ++k) {
    room.pillar_moved = push(k);
    const auto step = odometry.track(room.draw(pathAt(k), k));
    if (step) T_start_now = T_start_now * step->T_from_to;
    const SE3 T_world_object =
        SE3{Eigen::Quaterniond::Identity(), push(k)} * TexturedRoom::poseOfObject();
    const std::vector<ObjectMeasurement> seen{room.measureObject(pathAt(k), k, T_world_object)};
    const bool moves = k > kPushedAt;
    if (moves && told) odometry.leaveOut(seen);
    odometry.update(std::span(seen).first(!moves && odometry.wantsObjects() ? 1 : 0));
    if (odometry.started() && start < 0) start = k;
    if (k < kPushedAt || !step || step->health <= 0) continue;
    const SE3 T_start_true = pathAt(start).inverse() * pathAt(k);
    const double error_m = (T_start_now.translation - T_start_true.translation).norm();
    played.error_m = std::max(played.error_m, error_m);
    played.far_off += error_m > 0.03;
  }
  return played;
}

// Once it is pushed so near that it hides the room, nothing is measured any more.
TEST(MovingObjects, DoNotCarryTheCameraAlong) {
  EXPECT_GT(play(false).far_off, 20);
  const Played told = play(true);
  EXPECT_EQ(told.far_off, 0);
  EXPECT_LT(told.error_m, 0.015);
}

}  // namespace
}  // namespace diorama
