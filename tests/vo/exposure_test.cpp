#include "vo/exposure.h"

#include <gtest/gtest.h>

#include "tests/vo/textured_room.h"
#include "vo/corners.h"
#include "vo/reprojection.h"

namespace diorama::vo {
namespace {

constexpr double kBackWallM = 1.2;

// A sharp keyframe with points on the back wall, and a frame of a camera that turns.
struct Turn {
  test::TexturedRoom room;
  VoOptions options;
  Map map;
  TrackedFrame frame;

  explicit Turn(double share, double turn_rad = 0.1) {
    room.pillar = false;
    room.noise = 0;
    TrackedFrame sharp;
    sharp.pyramid = std::make_shared<const ImagePyramid>(room.draw(SE3{}, 0).gray, 5);
    Keyframe& keyframe = map.addKeyframe(sharp);
    const CellGrid grid(room.camera.width(), room.camera.height(), options.cell_px);
    for (const Corner& c : detectCorners(*sharp.pyramid, 1, grid,
                                         std::vector<uint8_t>(grid.size(), 0), 200, options)) {
      const auto bearing = room.camera.unproject(c.u_px);
      const Vector3d p = kBackWallM * bearing.value_or(Vector3d(9, 9, 1));
      if (std::abs(p.x()) < 0.9 && std::abs(p.y()) < 0.7)
        map.addPoint(keyframe, p, hostMeasurement(c.u_px, c.level, options));
    }
    const SE3 turned{expSO3(Vector3d(0, turn_rad, 0)), Vector3d::Zero()};
    frame.pyramid = std::make_shared<const ImagePyramid>(open(turn_rad, share), 5);
    frame.T_world_camera = frame.T_before_now = turned;
    for (const auto& point : map.points) {
      const auto u = room.camera.project(turned.inverse() * point->p_world);
      if (!u || !room.camera.contains(*u, 15)) continue;
      Feature feature;
      feature.u_px = *u;
      feature.point = point.get();
      frame.features.push_back(feature);
    }
  }

  // The mean of what is seen while the shutter is open, about the turn's end.
  Image<uint8_t> open(double turn_rad, double share) const {
    constexpr int kShots = 16;
    Image<int> sum(room.camera.width(), room.camera.height(), 0);
    for (int k = 0; k < kShots; ++k) {
      const double part = 1 + share * ((k + 0.5) / kShots - 0.5);
      const Image<uint8_t> shot =
          room.draw({expSO3(Vector3d(0, part * turn_rad, 0)), Vector3d::Zero()}, k).gray;
      for (int y = 0; y < sum.height; ++y)
        for (int x = 0; x < sum.width; ++x) sum(x, y) += shot(x, y);
    }
    Image<uint8_t> mean(sum.width, sum.height);
    for (int y = 0; y < sum.height; ++y)
      for (int x = 0; x < sum.width; ++x) mean(x, y) = static_cast<uint8_t>(sum(x, y) / kShots);
    return mean;
  }
};

TEST(Exposure, IsLearntFromBlur) {
  for (const double share : {0.0, 0.25, 0.6}) {
    const Turn turn(share);
    ASSERT_GT(turn.frame.features.size(), 30u);
    ExposureLearning learning(turn.options);
    for (int k = 0; k < 100; ++k) learning.learn(turn.room.camera, turn.frame);
    EXPECT_NEAR(learning.share(), share, 0.1);
  }
}

TEST(Exposure, SlowMotionTellsNothing) {
  const Turn turn(0.6, 0.01);
  ExposureLearning learning(turn.options);
  const double before = learning.share();
  for (int k = 0; k < 100; ++k) learning.learn(turn.room.camera, turn.frame);
  EXPECT_EQ(learning.share(), before);
}

TEST(Exposure, BlurredPatchesAreFoundWhereTheyAre) {
  Turn turn(0.6);
  const std::vector<Feature> truth = turn.frame.features;
  const auto meanError = [&](double share) {
    turn.frame.exposure_share = share;
    measureAll(turn.room.camera, turn.map, turn.frame, turn.options);
    double sum = 0;
    for (const Feature& found : turn.frame.features)
      for (const Feature& f : truth)
        if (f.point == found.point) sum += (f.u_px - found.u_px).norm();
    return sum / static_cast<double>(turn.frame.features.size());
  };
  const double as_sharp = meanError(0);
  const size_t found_as_sharp = turn.frame.features.size();
  EXPECT_LT(meanError(0.6), as_sharp);
  EXPECT_GT(turn.frame.features.size(), found_as_sharp);
}

TEST(Exposure, OnlyBlurThatTheReferenceLacksIsAdded) {
  Turn turn(0.25);
  turn.frame.exposure_share = 0.25;
  const Vector3d p = turn.map.points.front()->p_world;
  TrackedFrame reference = *turn.map.keyframes.front();
  EXPECT_GT(smearOf(turn.room.camera, turn.frame, reference, p).norm(), 3);
  reference.exposure_share = 0.5;
  reference.T_before_now = turn.frame.T_before_now;
  EXPECT_EQ(smearOf(turn.room.camera, turn.frame, reference, p).norm(), 0);
}

}  // namespace
}  // namespace diorama::vo
