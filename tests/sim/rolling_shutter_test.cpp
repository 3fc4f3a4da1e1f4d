// With a rolling shutter each row is seen from the pose of its own time.
#include <gtest/gtest.h>
#include <unistd.h>

#include "core/errors.h"
#include "sim/ray_renderer.h"
#include "sim/simulator.h"
#include "tests/sim/lit_scene.h"
#include "tests/sim/scene_support.h"

namespace diorama {
namespace {

using test::lit;
using test::object;
using test::plainScene;
using test::square;
using test::Workshop;

// A camera that sweeps past two slanted squares and one that sticks out of the image.
Scene sweepingScene(const Workshop& workshop) {
  Scene scene = plainScene();
  scene.camera = {CameraModel::kRadTan,           157, 91, 130, 131, 78.3, 44.1,
                  {-0.11, 0.045, 0.0006, -0.0004}};
  scene.path = makeSplinePath({{-1, lookAt(Vector3d(0, 0.6, 0.1), Vector3d(1, 1, 0), 0.3)},
                               {0, lookAt(Vector3d(0, 0, 0), Vector3d(1, 0, 0))},
                               {1, lookAt(Vector3d(0.1, -0.5, 0), Vector3d(1, -1, 0.2), -0.2)}});
  const auto file = workshop.write("s.obj", square(0.4));
  scene.objects = {object("back", file, Vector3d(1.2, 0.1, 0.05)),
                   object("front", file, Vector3d(0.8, -0.1, -0.1)),
                   object("out", file, Vector3d(1, 0.6, 0.2))};
  for (SceneObject& o : scene.objects)
    o.T_world_object.rotation = Eigen::AngleAxisd(0.6, Vector3d(0.2, 0.4, 1).normalized());
  scene.objects[1].scale = 0.4;
  return scene;
}

// The motion around a moment later than the frame's.
ExposureMotion motionAt(const Scene& scene, double later_s, double row_time_s) {
  ExposureMotion motion;
  motion.T_world_camera = [&scene, later_s](double offset_s) {
    return scene.path->pose(later_s + offset_s);
  };
  motion.row_time_s = row_time_s;
  return motion;
}

constexpr double kRowTime_s = 3e-4;  // some 27 ms for all rows

TEST(RollingShutter, EachRowIsThatOfAGlobalShutterAtItsTime) {
  const Workshop workshop("rows");
  const Scene scene = sweepingScene(workshop);
  const auto render_scene = lit(scene);
  const RayRenderer renderer(render_scene, Camera(scene.camera), {RenderQuality::kDraft, 1});
  const ExposureMotion rolling = motionAt(scene, 0, kRowTime_s);
  const RenderedFrame frame = renderer.render(rolling);
  EXPECT_NE(frame.depth_m, renderer.render(motionAt(scene, 0, 0)).depth_m);
  const int width = scene.camera.width, height = scene.camera.height;
  for (int y = 0; y < height; ++y) {
    const RenderedFrame still = renderer.render(motionAt(scene, rolling.rowOffset_s(y, height), 0));
    for (int x = 0; x < width; ++x) {
      ASSERT_EQ(frame.depth_m(x, y), still.depth_m(x, y)) << x << ' ' << y;
      ASSERT_EQ(frame.instance_id(x, y), still.instance_id(x, y));
      const Radiance &found = frame.radiance(x, y), &expected = still.radiance(x, y);
      for (float Radiance::*c : {&Radiance::r, &Radiance::g, &Radiance::b})  // rounded otherwise
        ASSERT_NEAR(found.*c, expected.*c, 1e-4f * (expected.*c + 0.01f));
      for (size_t o = 0; o < 3; ++o)
        ASSERT_EQ(frame.silhouettes[o].mask(x, y), still.silhouettes[o].mask(x, y));
    }
  }
}

// The object that sticks out, counted by a larger sensor whose rows go on in time.
TEST(RollingShutter, SilhouettesGoOnBeyondTheImage) {
  const Workshop workshop("beyond");
  Scene scene = sweepingScene(workshop);
  scene.camera = {CameraModel::kPinhole, 157, 91, 130, 130, 78.3, 44.1, {}};
  const auto render_scene = lit(scene);
  CameraParameters wide = scene.camera;  // its middle row is that of the smaller sensor
  wide.width *= 3;
  wide.height *= 3;
  wide.cx += scene.camera.width;
  wide.cy += scene.camera.height;
  const auto seen = [&](const CameraParameters& camera) {
    return RayRenderer(render_scene, Camera(camera), {RenderQuality::kDraft, 1})
        .render(motionAt(scene, 0, kRowTime_s))
        .silhouettes;
  };
  const std::vector<Silhouette> small = seen(scene.camera), large = seen(wide);
  for (size_t o = 0; o < 3; ++o) {
    EXPECT_GT(large[o].px_valid, 100);
    EXPECT_NEAR(small[o].px_all, large[o].px_valid, 2) << o;
  }
  EXPECT_LT(small[2].px_valid, small[2].px_all);
}

// Samples of a sharp picture lie around the pixel, all at the row's moment; blur spreads them
// around it.
TEST(RollingShutter, ColourFollowsTheRow) {
  const Workshop workshop("colour");
  const Scene scene = sweepingScene(workshop);
  const auto render_scene = lit(scene);
  const RayRenderer renderer(render_scene, Camera(scene.camera), {RenderQuality::kHigh, 1});
  for (const double exposure_s : {0.0, 0.01}) {
    ExposureMotion rolling = motionAt(scene, 0, kRowTime_s);
    rolling.exposure_s = exposure_s;
    const RenderedFrame frame = renderer.render(rolling);
    double worst_same = 0, worst_other = 0;
    for (const int y : {0, 1, 20, 46, 90}) {
      ExposureMotion own = motionAt(scene, rolling.rowOffset_s(y, scene.camera.height), 0);
      ExposureMotion middle = motionAt(scene, 0, 0);
      own.exposure_s = middle.exposure_s = exposure_s;
      const RenderedFrame at_row = renderer.render(own), at_middle = renderer.render(middle);
      const auto rms = [&](const RenderedFrame& other) {
        double sum = 0;
        for (int x = 0; x < scene.camera.width; ++x)
          sum += std::pow(static_cast<double>(frame.radiance(x, y).g - other.radiance(x, y).g), 2);
        return std::sqrt(sum / scene.camera.width);
      };
      worst_same = std::max(worst_same, rms(at_row));
      worst_other = std::max(worst_other, rms(at_middle));
    }
    EXPECT_LT(worst_same, 0.006) << exposure_s;  // sample counts may differ on edges
    EXPECT_GT(worst_other, 0.03) << exposure_s;
  }
}

TEST(RollingShutter, TruthHoldsThePoseOfEachRow) {
  const Workshop workshop("poses");
  Scene scene = sweepingScene(workshop);
  EXPECT_TRUE(Simulator(scene, {RenderQuality::kDraft, 1}).read(3).truth->row_poses.empty());
  scene.row_time_s = kRowTime_s;
  const GroundTruth truth = *Simulator(scene, {RenderQuality::kDraft, 1}).read(3).truth;
  ASSERT_EQ(truth.row_poses.size(), 91u);
  EXPECT_EQ(truth.row_poses[45].matrix(), truth.T_world_camera.matrix());
  const SE3 expected = scene.path->pose(0.1 - 45 * kRowTime_s);
  EXPECT_LT((truth.row_poses[0].matrix() - expected.matrix()).norm(), 1e-12);
}

TEST(RollingShutter, ThreadsDoNotChangeThePicture) {
  const Workshop workshop("threads");
  const Scene scene = sweepingScene(workshop);
  const auto render_scene = lit(scene);
  ExposureMotion motion = motionAt(scene, 0, kRowTime_s);
  motion.exposure_s = 0.005;
  const auto frame = [&](int threads) {
    return RayRenderer(render_scene, Camera(scene.camera), {RenderQuality::kStandard, threads})
        .render(motion);
  };
  const RenderedFrame one = frame(1), two = frame(2);
  EXPECT_EQ(one.radiance, two.radiance);
  EXPECT_EQ(one.depth_m, two.depth_m);
  EXPECT_EQ(one.silhouettes[2].px_all, two.silhouettes[2].px_all);
}

TEST(RollingShutter, RowTimeIsReadFromTheScene) {
  const std::string scene =
      "duration_s: 1\npath: {type: orbit, center: [0, 0, 0], radius_m: 1, height_m: 0, rate_rad_s: "
      "1}\ncamera: {width: 64, height: 50, "
      "fx: 50, fy: 50, cx: 31.5, cy: 24.5, rate_hz: 20, row_time_s: ";
  EXPECT_EQ(parseScene(scene + "0.001}\n", "s.yaml").row_time_s, 0.001);
  EXPECT_NE(describeScene(parseScene(scene + "0.001}\n", "s.yaml")),
            describeScene(parseScene(scene + "0}\n", "s.yaml")));
  EXPECT_THROW(parseScene(scene + "0.0011}\n", "s.yaml"), InputError);  // longer than a frame
  EXPECT_THROW(parseScene(scene + "-0.001}\n", "s.yaml"), InputError);
}

}  // namespace
}  // namespace diorama
