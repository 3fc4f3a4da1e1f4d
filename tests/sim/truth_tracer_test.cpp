// Normals and optical flow against geometry that is known exactly.
#include <gtest/gtest.h>
#include <unistd.h>

#include <map>

#include "core/random.h"
#include "sim/simulator.h"
#include "tests/sim/scene_support.h"

namespace diorama {
namespace {

using test::object;
using test::plainScene;
using test::square;
using test::Workshop;

const RenderOptions kAll = {RenderQuality::kDraft, 1, {.normal = true, .flow = true}};

// Two frames a tenth of a second apart.
Scene twoFrames(const SE3& first, const SE3& second) {
  Scene scene = plainScene();
  scene.rate_hz = 10;
  scene.duration_s = 0.2;
  scene.path = makeSplinePath({{0, first}, {0.1, second}});
  return scene;
}

SE3 lookAhead(const Vector3d& from) { return lookAt(from, from + Vector3d(1, 0, 0)); }

TEST(Flow, OfAPlaneUnderATranslation) {
  const Workshop workshop("flow_plane");
  Scene scene = twoFrames(lookAhead({0, 0, 0}), lookAhead({0.25, 0.1, 0.06}));
  scene.objects = {object("wall", workshop.write("w.obj", square(3)), Vector3d(1, 0, 0))};
  Simulator simulator(scene, kAll);
  const FlowField flow = *simulator.read(0).truth->flow;
  EXPECT_EQ(flow.from, 0);
  EXPECT_EQ(flow.to, 1);
  std::map<FlowState, int> seen;
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x) {
      // (right, down) = (x - cx, y - cy) / f at 1 m, then 0.75 m away and shifted.
      const double right = (x - 79.5) / 130 + 0.1, down = (y - 59.5) / 130 + 0.06;
      const Vector2d u(79.5 + 130 * right / 0.75, 59.5 + 130 * down / 0.75);
      ASSERT_NEAR(static_cast<double>(flow.flow_px(x, y).u), u.x() - x, 1e-4) << x << ' ' << y;
      ASSERT_NEAR(static_cast<double>(flow.flow_px(x, y).v), u.y() - y, 1e-4);
      ASSERT_EQ(flow.state(x, y),
                simulator.camera().contains(u) ? FlowState::kVisible : FlowState::kOutside);
      ++seen[flow.state(x, y)];
    }
  EXPECT_GT(seen[FlowState::kVisible], 5000);
  EXPECT_GT(seen[FlowState::kOutside], 5000);
  EXPECT_FALSE(simulator.read(1).truth->flow.has_value());  // the last frame
  // Back again: what was seen maps to where it came from.
  const FlowField back = simulator.flow(1, 0);
  EXPECT_EQ(back.state(80, 60), FlowState::kVisible);
  EXPECT_NEAR(static_cast<double>(back.flow_px(80, 60).u),
              79.5 + 130 * (0.75 * 0.5 / 130 - 0.1) - 80, 1e-4);
}

// A small square slides before a larger one as the camera moves sideways.
TEST(Flow, TellsWhyAPointIsNotSeen) {
  const Workshop workshop("flow_reasons");
  Scene scene = twoFrames(lookAhead({0, 0, 0}), lookAhead({0, 0.2, 0}));
  scene.objects = {object("back", workshop.write("b.obj", square(0.5)), Vector3d(1.2, 0, 0)),
                   object("front", workshop.write("f.obj", square(0.1)), Vector3d(0.6, 0, 0))};
  Simulator simulator(scene, kAll);
  const GroundTruth truth = *simulator.read(0).truth;
  const FlowField& flow = *truth.flow;
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x) {
      const int id = truth.instance_id(x, y);
      if (id == 0) {
        ASSERT_EQ(flow.state(x, y), FlowState::kNoSurface);
        continue;
      }
      // On the line of sight of the second camera, 0.6 m away, right of its middle.
      const double z = id == 1 ? 1.2 : 0.6, right = (x - 79.5) / 130 * z + 0.2;
      const double at_front = right * 0.6 / z - 0.2, down_at_front = (y - 59.5) / 130 * 0.6;
      const bool hidden = id == 1 && std::abs(at_front) < 0.05 && std::abs(down_at_front) < 0.05;
      const bool outside = 79.5 + 130 * right / z > 159.5;
      ASSERT_EQ(flow.state(x, y), outside  ? FlowState::kOutside
                                  : hidden ? FlowState::kHiddenByOther
                                           : FlowState::kVisible)
          << x << ' ' << y;
    }
}

// An open box around the camera's target: its near rim hides its inside as the camera sinks.
TEST(Flow, HiddenByItself) {
  const Workshop workshop("flow_self");
  Scene scene = twoFrames(lookAt({0, 0, 0.8}, {1, 0, 0}), lookAhead({0, 0, 0.02}));
  // A floor at z = 0 and a front wall at x = -0.2 up to z = 0.1, one object.
  scene.objects = {object("tray",
                          workshop.write("t.obj",
                                         "v -0.2 0.2 0\nv -0.2 -0.2 0\nv 0.2 -0.2 0\nv 0.2 0.2 0\n"
                                         "v -0.2 0.2 0.1\nv -0.2 -0.2 0.1\n"
                                         "f 1 2 3 4\nf 1 5 6 2\n"),
                          Vector3d(1, 0, 0))};
  Simulator simulator(scene, kAll);
  const GroundTruth truth = *simulator.read(0).truth;
  std::map<FlowState, int> seen;
  for (const FlowState state : truth.flow->state.pixels) ++seen[state];
  EXPECT_GT(seen[FlowState::kHiddenBySelf], 200);  // the floor
  EXPECT_GT(seen[FlowState::kVisible], 200);       // the wall
  EXPECT_EQ(seen[FlowState::kHiddenByOther], 0);
}

Scene shakenScene(const Workshop& workshop) {
  const SE3 first = lookAt({0, 0.1, 0.1}, {1, 0, 0}, 0.1),
            second = lookAt({0.1, -0.1, 0}, {1, 0, 0});
  Scene scene = twoFrames(first, second);
  scene.path = makeSplinePath({{-0.1, second}, {0, first}, {0.1, second}, {0.2, first}});
  scene.camera = {CameraModel::kRadTan,           320, 240, 260, 261, 158.3, 121.1,
                  {-0.11, 0.045, 0.0006, -0.0004}};
  scene.objects = {object("wall", workshop.write("w.obj", square(3)), Vector3d(1.6, 0, 0)),
                   object("a", workshop.write("a.obj", square(0.4)), Vector3d(1, 0.2, 0.1)),
                   object("b", workshop.write("b.obj", square(0.2)), Vector3d(0.8, -0.1, -0.1))};
  for (SceneObject& o : scene.objects)
    o.T_world_object.rotation = Eigen::AngleAxisd(0.4, Vector3d(0.3, 0.5, 0.2).normalized());
  return scene;
}

// Depth in memory, poses and flow close; with a rolling shutter by the poses of the rows.
TEST(Flow, ClosesWithDepthAndPoses) {
  const Workshop workshop("flow_closes");
  for (const double row_time_s : {0.0, 2e-4}) {
    Scene scene = shakenScene(workshop);
    scene.row_time_s = row_time_s;
    Simulator simulator(scene, kAll);
    const GroundTruth a = *simulator.read(0).truth, b = *simulator.read(1).truth;
    const Camera& camera = simulator.camera();
    const auto row_pose = [&](const GroundTruth& truth, double row) {
      if (truth.row_poses.empty()) return truth.T_world_camera;
      return scene.path->pose(static_cast<double>(truth.timestamp_ns) * 1e-9 +
                              row_time_s * (row - 119.5));
    };
    const Random random(5, RandomStream::kTest);
    int checked = 0, agree = 0;
    double worst = 0;
    for (uint64_t k = 0; checked < 100000 && k < 1000000; ++k) {
      const auto r = random.uniform(0, k);
      const int x = static_cast<int>(r[0] * 320), y = static_cast<int>(r[1] * 240);
      if (a.flow->state(x, y) != FlowState::kVisible) continue;
      const Vector3d p_world = row_pose(a, y) * (static_cast<double>(a.depth_m(x, y)) *
                                                 *camera.unproject(Vector2d(x, y)));
      const Vector2d u(x + static_cast<double>(a.flow->flow_px(x, y).u),
                       y + static_cast<double>(a.flow->flow_px(x, y).v));
      const Vector3d p_other = row_pose(b, u.y()).inverse() * p_world;
      worst = std::max(worst, (*camera.project(p_other) - u).norm());
      // The other frame's depth there, where it is smooth.
      const int ux = static_cast<int>(std::lround(u.x())),
                uy = static_cast<int>(std::lround(u.y()));
      agree += std::abs(static_cast<double>(b.depth_m(ux, uy)) - p_other.z()) < 0.02;
      ++checked;
    }
    EXPECT_EQ(checked, 100000);
    EXPECT_LT(worst, 0.01) << row_time_s;
    EXPECT_GT(agree, 98500);  // all but those on outlines
  }
}

// A square that slides to the right by 0.2 m before a wall that rests.
TEST(Flow, FollowsWhatMoves) {
  const Workshop workshop("flow_moves");
  Scene scene = twoFrames(lookAhead({0, 0, 0}), lookAhead({0, 0, 0}));
  scene.objects = {object("wall", workshop.write("w.obj", square(3)), Vector3d(2, 0, 0)),
                   object("sledge", workshop.write("s.obj", square(0.3)), Vector3d(1, 0.1, 0))};
  scene.objects[1].path =
      makeSplinePath({{0, {Eigen::Quaterniond::Identity(), Vector3d(1, 0.1, 0)}},
                      {0.1, {Eigen::Quaterniond::Identity(), Vector3d(1, -0.1, 0)}}});
  Simulator simulator(scene, kAll);
  const GroundTruth truth = *simulator.read(0).truth;
  std::map<FlowState, int> wall;
  int sledge = 0;
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x) {
      const bool moves = truth.instance_id(x, y) == 2;
      ASSERT_NEAR(static_cast<double>(truth.flow->flow_px(x, y).u), moves ? 26 : 0, 1e-4);
      ASSERT_NEAR(static_cast<double>(truth.flow->flow_px(x, y).v), 0, 1e-4);
      ASSERT_NEAR(static_cast<double>(truth.normal(x, y).z), -1, 1e-6);
      if (!moves) ++wall[truth.flow->state(x, y)];
      if (moves) {
        ASSERT_EQ(truth.flow->state(x, y), FlowState::kVisible);
        ++sledge;
      }
    }
  EXPECT_NEAR(sledge, 39 * 39, 80);
  EXPECT_NEAR(wall[FlowState::kHiddenByOther], 26 * 39, 60);  // what the sledge newly covers
  EXPECT_EQ(wall[FlowState::kHiddenBySelf] + wall[FlowState::kOutside], 0);
}

TEST(Flow, ThreadsDoNotChangeIt) {
  const Workshop workshop("flow_threads");
  const Scene scene = shakenScene(workshop);
  RenderOptions two = kAll;
  two.threads = 2;
  const GroundTruth a = *Simulator(scene, kAll).read(0).truth,
                    b = *Simulator(scene, two).read(0).truth;
  EXPECT_EQ(a.flow->flow_px, b.flow->flow_px);
  EXPECT_EQ(a.flow->state, b.flow->state);
  EXPECT_EQ(a.normal, b.normal);
}

TEST(Normals, PointTowardsTheCameraInItsFrame) {
  const Workshop workshop("normals");
  Scene scene = shakenScene(workshop);
  for (const double row_time_s : {0.0, 2e-4}) {
    scene.row_time_s = row_time_s;
    const GroundTruth truth = *Simulator(scene, kAll).read(0).truth;
    int checked = 0;
    for (int y = 0; y < 240; ++y) {
      const SE3& T_world_camera =
          truth.row_poses.empty() ? truth.T_world_camera : truth.row_poses[static_cast<size_t>(y)];
      for (int x = 0; x < 320; ++x) {
        const Normal n = truth.normal(x, y);
        const int id = truth.instance_id(x, y);
        if (id == 0) {
          ASSERT_EQ(n, Normal{});
          continue;
        }
        const Vector3d expected =
            T_world_camera.rotation.inverse() *
            (scene.objects[static_cast<size_t>(id - 1)].T_world_object.rotation *
             Vector3d(-1, 0, 0));
        ASSERT_NEAR((Vector3d(static_cast<double>(n.x), static_cast<double>(n.y),
                              static_cast<double>(n.z)) -
                     expected)
                        .norm(),
                    0, 1e-6);
        ++checked;
      }
    }
    EXPECT_GT(checked, 50000);
  }
  EXPECT_TRUE(Simulator(scene, {RenderQuality::kDraft, 1}).read(0).truth->normal.empty());
}

TEST(Exposure, OpensAndClosesAroundTheTimestamp) {
  Scene scene = plainScene();
  scene.exposure_s = 0.01;
  const GroundTruth truth = *Simulator(scene, {RenderQuality::kDraft, 1}).read(3).truth;
  EXPECT_EQ(truth.open_ns, 95000000);
  EXPECT_EQ(truth.timestamp_ns, 100000000);
  EXPECT_EQ(truth.close_ns, 105000000);
}

}  // namespace
}  // namespace diorama
