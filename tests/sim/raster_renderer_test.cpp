// The raster renderer against the ray renderer and against what is known exactly.
#include "sim/raster_renderer.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <future>

#include "core/errors.h"
#include "sim/ray_renderer.h"
#include "tests/sim/lit_scene.h"
#include "tests/sim/scene_support.h"
#include "tests/sim/test_pictures.h"

// Read by the sanitizers. Mesa keeps some 200 bytes of every context that there was, and its fences
// order its threads in a way that the thread sanitizer does not see. GDAL, by which OpenCV reads
// images, takes its two locks in either order, on one thread.
extern "C" const char* __lsan_default_suppressions() { return "leak:libOSMesa.so\n"; }
extern "C" const char* __tsan_default_suppressions() {
  return "race:libOSMesa.so\ndeadlock:libgdal.so\n";
}

namespace diorama {
namespace {

using test::kDistorted;
using test::lit;
using test::object;
using test::plainScene;
using test::refinedCorner;
using test::sphere;
using test::square;
using test::Workshop;
using test::writeCheckerboard;

const CameraParameters kFisheye = {CameraModel::kFisheye,       160, 120, 62, 61, 80.4, 59.2,
                                   {0.02, -0.01, 0.003, -0.001}};

// A lit ball before a board, a pole little wider than a pixel, and squares at the sides that only a
// fisheye sees.
Scene cluttered(const Workshop& workshop) {
  Scene scene = plainScene();
  const auto plain = workshop.write("p.obj", square(0.5));
  workshop.write("paint.mtl", "newmtl paint\nKd 0.7 0.5 0.3\nKs 0 0 0\n");
  const auto ball =
      workshop.write("ball.obj", "mtllib paint.mtl\nusemtl paint\n" + sphere(0.1, 30));
  const auto pole = workshop.write(
      "pole.obj", "v 0 0 -0.4\nv 0 0.006 -0.4\nv 0 0.006 0.4\nv 0 0 0.4\nf 1 2 3 4\n");
  scene.objects = {object("board", writeCheckerboard(workshop), Vector3d(1, 0.02, 0)),
                   object("ball", ball, Vector3d(0.7, 0.1, 0.03)),
                   object("pole", pole, Vector3d(0.6, -0.08, 0)),
                   object("left", plain, Vector3d(0.1, 0.9, 0.1)),
                   object("above", plain, Vector3d(0.1, 0, 0.8))};
  const auto turn = [&](size_t i, double angle, const Vector3d& axis) {
    scene.objects[i].T_world_object.rotation = Eigen::AngleAxisd(angle, axis);
  };
  turn(3, 1.4, Vector3d::UnitZ());
  turn(4, -1.4, Vector3d::UnitY());
  scene.lights = {
      {Vector3d(0.2, 0.3, 1.5), Vector3d(0.2, 0, 0), Vector3d(0, -0.2, 0), Vector3d(20, 18, 15)}};
  scene.ambient = 0.3;
  return scene;
}

template <class R>
RenderedFrame renderStill(const std::shared_ptr<const RenderScene>& scene,
                          const CameraParameters& camera,
                          RenderQuality quality = RenderQuality::kDraft, int threads = 1) {
  const SE3 pose = lookAt(Vector3d::Zero(), Vector3d(1, 0.01, 0.02), 0.1);
  return R(scene, Camera(camera), {quality, threads}).render({.T_world_camera = [&](double) {
    return pose;
  }});
}

TEST(RasterRenderer, TruthIsTheRayRenderers) {
  const Workshop workshop("raster_truth");
  const Scene scene = cluttered(workshop);
  const auto lit_scene = lit(scene);
  for (const CameraParameters& camera : {scene.camera, kDistorted, kFisheye}) {
    const auto ray = renderStill<RayRenderer>(lit_scene, camera);
    const auto raster = renderStill<RasterRenderer>(lit_scene, camera);
    int differ = 0;
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) {
        if (ray.instance_id(x, y) != raster.instance_id(x, y))
          ++differ;
        else
          ASSERT_NEAR(static_cast<double>(raster.depth_m(x, y)),
                      static_cast<double>(ray.depth_m(x, y)), 1e-5)
              << x << ' ' << y;
      }
    EXPECT_LE(differ, 4) << toString(camera.model);  // rays that meet an outline to the last bit
    ASSERT_EQ(raster.silhouettes.size(), ray.silhouettes.size());
    for (size_t i = 0; i < ray.silhouettes.size(); ++i) {
      EXPECT_NEAR(raster.silhouettes[i].px_all, ray.silhouettes[i].px_all, 1);
      EXPECT_NEAR(raster.silhouettes[i].px_visible, ray.silhouettes[i].px_visible, 4);
    }
    EXPECT_GT(ray.silhouettes[2].px_visible, 10) << "the pole must be seen";
  }
  EXPECT_GT(renderStill<RayRenderer>(lit_scene, kFisheye).silhouettes[3].px_visible, 100);
}

// Battens on a wall, a quarter of a pixel wide, with the wall on both sides.
TEST(RasterRenderer, TruthShowsWhatIsNarrowerThanAPixel) {
  const Workshop workshop("raster_narrow");
  Scene scene = plainScene();
  scene.objects = {object("wall", workshop.write("wall.obj", square(3)), Vector3d(1, 0, 0))};
  const auto batten =
      workshop.write("batten.obj", "v 0 1 0\nv 0 -1 0\nv 0 -1 0.002\nv 0 1 0.002\nf 1 2 3 4\n");
  for (int k = 0; k < 20; ++k)
    scene.objects.push_back(
        object("batten" + std::to_string(k), batten, Vector3d(0.98, 0, 0.0317 * k - 0.3), false));
  const auto lit_scene = lit(scene);
  const auto ray = renderStill<RayRenderer>(lit_scene, kDistorted);
  const auto raster = renderStill<RasterRenderer>(lit_scene, kDistorted);
  EXPECT_EQ(raster.instance_id, ray.instance_id);
  EXPECT_GT(std::count_if(ray.instance_id.pixels.begin(), ray.instance_id.pixels.end(),
                          [](uint16_t id) { return id > 1; }),
            200);
}

TEST(RasterRenderer, ColorsAreTheRayRenderers) {
  const Workshop workshop("raster_color");
  const Scene scene = cluttered(workshop);
  const auto lit_scene = lit(scene);
  for (const RenderQuality quality : {RenderQuality::kDraft, RenderQuality::kStandard})
    for (const CameraParameters& camera : {scene.camera, kDistorted, kFisheye}) {
      const auto ray = renderStill<RayRenderer>(lit_scene, camera, quality).radiance;
      const auto raster = renderStill<RasterRenderer>(lit_scene, camera, quality).radiance;
      const auto brightness = [](const Radiance& p) {
        return static_cast<double>(p.r + p.g + p.b) / 3;
      };
      double sum = 0, difference = 0, bias = 0;
      for (size_t i = 0; i < ray.pixels.size(); ++i) {
        sum += brightness(ray.pixels[i]);
        difference += std::abs(brightness(raster.pixels[i]) - brightness(ray.pixels[i]));
        bias += brightness(raster.pixels[i]) - brightness(ray.pixels[i]);
      }
      EXPECT_LT(std::abs(bias), 0.003 * sum) << toString(camera.model);
      EXPECT_LT(difference, 0.03 * sum) << toString(camera.model);  // most of it at outlines
    }
}

TEST(RasterRenderer, CheckerboardCornerLiesWhereTheCameraProjectsIt) {
  const Workshop workshop("raster_corner");
  const std::filesystem::path board = writeCheckerboard(workshop);
  const CameraParameters pinhole = {CameraModel::kPinhole, 320, 240, 260, 260, 159.5, 119.5, {}};
  const CameraParameters distorted = {CameraModel::kRadTan, 320, 240, 261.4, 261.7, 159.1, 121.3,
                                      kDistorted.distortion};
  for (const CameraParameters& parameters : {pinhole, distorted})
    for (const RenderQuality quality : {RenderQuality::kStandard, RenderQuality::kHigh})
      for (const auto& [right, up] : {std::pair(0.113, 0.057), {-0.31, 0.22}, {0.237, -0.249}}) {
        Scene scene = plainScene();
        scene.camera = parameters;
        scene.objects = {object("board", board, Vector3d(1, -right, up))};
        const RasterRenderer renderer(lit(scene), Camera(parameters), {quality, 1});
        const SE3 pose = scene.path->pose(0);
        const auto frame = renderer.render({.T_world_camera = [&](double) { return pose; }});
        const Vector2d expected = *Camera(parameters).project(Vector3d(right, -up, 1));
        const Vector2d found = refinedCorner(frame.radiance, expected);
        EXPECT_NEAR(found.x(), expected.x(), 0.05);
        EXPECT_NEAR(found.y(), expected.y(), 0.05);
      }
}

TEST(RasterRenderer, BlurIsTheMeanOfSharpFrames) {
  const Workshop workshop("raster_blur");
  Scene scene = plainScene();
  scene.objects = {object("board", writeCheckerboard(workshop), Vector3d(1, 0, 0))};
  const RasterRenderer renderer(lit(scene), Camera(scene.camera), {RenderQuality::kHigh, 1});
  const SE3 start = scene.path->pose(0);
  const double exposure_s = 0.01;
  const auto at = [&](double time_s) {  // 5 px to the right, 2 px upwards
    SE3 pose = start;
    pose.translation += Vector3d(0, -5.0 / 130, 2.0 / 130) * (time_s / exposure_s);
    return pose;
  };
  const Image<Radiance> blurred =
      renderer.render({.T_world_camera = at, .exposure_s = exposure_s}).radiance;
  std::vector<double> mean(blurred.pixels.size());
  constexpr int kFrames = 64;
  for (int k = 0; k < kFrames; ++k) {
    const SE3 pose = at(exposure_s * ((k + 0.5) / kFrames - 0.5));
    const auto sharp = renderer.render({.T_world_camera = [&](double) { return pose; }});
    for (size_t i = 0; i < mean.size(); ++i)
      mean[i] += static_cast<double>(sharp.radiance.pixels[i].g) / kFrames;
  }
  double bias = 0, square_sum = 0;
  for (size_t i = 0; i < mean.size(); ++i) {
    const double d = static_cast<double>(blurred.pixels[i].g) - mean[i];
    bias += d / static_cast<double>(mean.size());
    square_sum += d * d / static_cast<double>(mean.size());
  }
  EXPECT_LT(std::abs(bias), 1.0 / 255);  // white is 1
  EXPECT_LT(std::sqrt(square_sum), 4.0 / 255);
}

void expectSame(const RenderedFrame& a, const RenderedFrame& b) {
  EXPECT_EQ(a.radiance, b.radiance);
  EXPECT_EQ(a.depth_m, b.depth_m);
  EXPECT_EQ(a.instance_id, b.instance_id);
  EXPECT_EQ(a.silhouettes[1].mask, b.silhouettes[1].mask);
}

class Sliding : public MotionPath {  // along y, 1 m/s
 public:
  explicit Sliding(const Vector3d& start) { start_.translation = start; }
  SE3 pose(double time_s) const override {
    SE3 result = start_;
    result.translation.y() += time_s;
    return result;
  }

 private:
  SE3 start_;
};

TEST(RasterRenderer, MovingObjectsAreTheRayRenderers) {
  const Workshop workshop("raster_moving");
  Scene scene = cluttered(workshop);
  scene.objects[1].path = std::make_shared<Sliding>(scene.objects[1].T_world_object.translation);
  const auto lit_scene = lit(scene);
  ExposureMotion motion;
  motion.T_world_camera = [&](double t) { return scene.path->pose(t); };
  motion.T_world_object = [&](size_t i, double t) { return scene.objects[i].pose(t); };
  motion.exposure_s = 0.02;
  const RenderOptions options{RenderQuality::kStandard, 1};
  const auto ray = RayRenderer(lit_scene, Camera(kDistorted), options).render(motion);
  const auto raster = RasterRenderer(lit_scene, Camera(kDistorted), options).render(motion);
  int differ = 0, seen = 0;
  double difference = 0, sum = 0;
  for (size_t i = 0; i < ray.depth_m.pixels.size(); ++i) {
    const bool same = ray.instance_id.pixels[i] == raster.instance_id.pixels[i];
    differ += !same;
    seen += ray.instance_id.pixels[i] == 2;
    if (same) {
      ASSERT_NEAR(static_cast<double>(raster.depth_m.pixels[i]),
                  static_cast<double>(ray.depth_m.pixels[i]), 1e-5);
    }
    difference +=
        static_cast<double>(std::abs(raster.radiance.pixels[i].g - ray.radiance.pixels[i].g));
    sum += static_cast<double>(ray.radiance.pixels[i].g);
  }
  EXPECT_LE(differ, 4);
  EXPECT_GT(seen, 500);
  EXPECT_LT(difference, 0.03 * sum);
  EXPECT_EQ(raster.silhouettes[1].px_all, ray.silhouettes[1].px_all);
}

TEST(RasterRenderer, ThreadsDoNotChangeThePicture) {
  const Workshop workshop("raster_threads");
  Scene scene = cluttered(workshop);
  scene.camera.width = 161;  // no whole number of tiles or packets
  scene.camera.height = 97;
  const auto lit_scene = lit(scene);
  const auto render = [&](int threads) {
    return renderStill<RasterRenderer>(lit_scene, scene.camera, RenderQuality::kStandard, threads);
  };
  const RenderedFrame once = render(1);
  expectSame(render(1), once);
  expectSame(render(2), once);
  // Several callers at once, as the simulator's are: one renderer each.
  std::vector<std::future<RenderedFrame>> callers;
  for (int k = 0; k < 3; ++k) callers.push_back(std::async(std::launch::async, render, 1));
  for (auto& caller : callers) expectSame(caller.get(), once);
}

TEST(RasterRenderer, MayBeCalledFromAnotherThreadThanBefore) {
  const Workshop workshop("raster_moves");
  Scene scene = cluttered(workshop);
  const RasterRenderer renderer(lit(scene), Camera(scene.camera), {RenderQuality::kDraft, 1});
  const auto render = [&] {
    return renderer.render({.T_world_camera = [&](double) { return scene.path->pose(0); }});
  };
  const RenderedFrame here = render();
  expectSame(std::async(std::launch::async, render).get(), here);
}

TEST(RasterRenderer, RefusesARollingShutter) {
  const Workshop workshop("raster_rolling");
  Scene scene = plainScene();
  scene.objects = {object("p", workshop.write("p.obj", square(0.5)), Vector3d(1, 0, 0))};
  const RasterRenderer renderer(lit(scene), Camera(scene.camera), {RenderQuality::kDraft, 1});
  EXPECT_THROW(
      renderer.render({.T_world_camera = [](double) { return SE3{}; }, .row_time_s = 1e-5}), Error);
}

}  // namespace
}  // namespace diorama
