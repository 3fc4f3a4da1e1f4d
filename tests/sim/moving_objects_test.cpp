// Objects that move against the same scene with objects that rest, where the light is baked.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>

#include "sim/light_baker.h"
#include "sim/ray_renderer.h"
#include "tests/sim/scene_support.h"

namespace diorama {
namespace {

using test::FixedPath;
using test::object;
using test::plainScene;
using test::square;
using test::Workshop;

// A closed box of half sizes x, y, z; with normals that point outwards.
std::string box(double x, double y, double z) {
  std::string text = "mtllib paint.mtl\n";
  for (int k = 0; k < 8; ++k)
    text += "v " + std::to_string(k & 1 ? x : -x) + ' ' + std::to_string(k & 2 ? y : -y) + ' ' +
            std::to_string(k & 4 ? z : -z) + '\n';
  return text + "usemtl paint\nf 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
}

// A wall at x = 2 with a small box before it, a lamp above the camera and some sky.
Scene boxBeforeWall(const Workshop& workshop) {
  Scene scene = plainScene();
  workshop.write("paint.mtl", "newmtl paint\nKd 0.6 0.5 0.4\nKs 0 0 0\n");
  scene.lights = {{Vector3d(0.2, 0.5, 0.9), Vector3d(0, 0.15, 0), Vector3d(-0.05, 0, 0.15),
                   Vector3d(90, 90, 90)}};
  scene.ambient = 0.2;
  scene.objects = {
      object("wall", workshop.write("w.obj", square(4, "mtllib paint.mtl\n")), Vector3d(2, 0, 0),
             false),
      object("box", workshop.write("b.obj", box(0.1, 0.2, 0.15)), Vector3d(1.5, -0.1, 0.05))};
  scene.objects[1].T_world_object.rotation =
      Eigen::AngleAxisd(0.5, Vector3d(0.2, 0.3, 1).normalized());
  return scene;
}

void moveBox(Scene& scene, std::shared_ptr<const MotionPath> path) {
  scene.objects[1].path = std::move(path);
}

std::shared_ptr<const RenderScene> lit(const Scene& scene) {
  auto result = std::make_shared<RenderScene>(makeRenderScene(scene));
  WorkerPool pool(2);
  bakeLight(*result, {.spacing_m = 0.02, .max_samples = 40000, .last_bounce_rays = 64}, pool);
  return result;
}

ExposureMotion motionOf(const Scene& scene, double exposure_s = 0, double start_s = 0) {
  ExposureMotion motion;
  motion.T_world_camera = [&scene, start_s](double t) { return scene.path->pose(start_s + t); };
  motion.T_world_object = [&scene, start_s](size_t i, double t) {
    return scene.objects[i].pose(start_s + t);
  };
  motion.exposure_s = exposure_s;
  return motion;
}

class Sliding : public MotionPath {  // along y, 1 m/s
 public:
  explicit Sliding(const SE3& start) : start_(start) {}
  SE3 pose(double time_s) const override {
    SE3 result = start_;
    result.translation.y() += time_s;
    return result;
  }

 private:
  SE3 start_;
};

double meanDifference(const Image<Radiance>& a, const Image<Radiance>& b) {
  double sum = 0;
  for (size_t i = 0; i < a.pixels.size(); ++i)
    sum += std::abs(static_cast<double>(a.pixels[i].g) - static_cast<double>(b.pixels[i].g));
  return sum / static_cast<double>(a.pixels.size());
}

double mean(const Image<Radiance>& a) {
  return meanDifference(a, Image<Radiance>(a.width, a.height));
}

TEST(MovingObjects, TruthIsThatOfAnObjectAtRest) {
  const Workshop workshop("moving_truth");
  Scene scene = boxBeforeWall(workshop);
  const RayRenderer resting(lit(scene), Camera(scene.camera), {RenderQuality::kStandard, 1});
  const RenderedFrame expected = resting.render(motionOf(scene));
  moveBox(scene, std::make_shared<FixedPath>(scene.objects[1].T_world_object));
  const RayRenderer moving(lit(scene), Camera(scene.camera), {RenderQuality::kStandard, 1});
  const RenderedFrame frame = moving.render(motionOf(scene));
  int differ = 0;
  for (int y = 0; y < frame.depth_m.height; ++y)
    for (int x = 0; x < frame.depth_m.width; ++x) {
      if (frame.instance_id(x, y) != expected.instance_id(x, y))
        ++differ;  // a ray along an outline
      else
        EXPECT_NEAR(frame.depth_m(x, y), expected.depth_m(x, y), 2e-6);
    }
  EXPECT_LE(differ, 2);
  ASSERT_EQ(frame.silhouettes.size(), 1u);
  EXPECT_GT(frame.silhouettes[0].px_visible, 300);
  EXPECT_NEAR(frame.silhouettes[0].px_all, expected.silhouettes[0].px_all, 2);
  EXPECT_NEAR(frame.silhouettes[0].px_visible, expected.silhouettes[0].px_visible, 2);
}

TEST(MovingObjects, LightAndShadowAreThoseOfAnObjectAtRest) {
  const Workshop workshop("moving_light");
  Scene scene = boxBeforeWall(workshop);
  for (const RenderQuality quality : {RenderQuality::kDraft, RenderQuality::kStandard}) {
    const auto render = [&] {
      const RayRenderer renderer(lit(scene), Camera(scene.camera), {quality, 1});
      return renderer.render(motionOf(scene)).radiance;
    };
    scene.objects[1].path = nullptr;
    const Image<Radiance> expected = render();
    moveBox(scene, std::make_shared<FixedPath>(scene.objects[1].T_world_object));
    const Image<Radiance> frame = render();
    const double difference = meanDifference(frame, expected);
    EXPECT_LT(difference, 0.006 * mean(expected));
    // The object and its shadow are more than that.
    scene.objects[1].path =
        std::make_shared<FixedPath>(SE3{Eigen::Quaterniond::Identity(), Vector3d(-9, 0, 0)});
    EXPECT_GT(meanDifference(render(), expected), 5 * difference);
  }
}

TEST(MovingObjects, BlurIsTheMeanOfSharpFrames) {
  const Workshop workshop("moving_blur");
  Scene scene = boxBeforeWall(workshop);
  moveBox(scene, std::make_shared<Sliding>(scene.objects[1].T_world_object));
  const RayRenderer renderer(lit(scene), Camera(scene.camera), {RenderQuality::kHigh, 1});
  constexpr double kExposure_s = 0.06;  // 5 px
  const Image<Radiance> blurred = renderer.render(motionOf(scene, kExposure_s)).radiance;
  constexpr int kFrames = 32;
  std::vector<double> sharp(blurred.pixels.size());
  for (int k = 0; k < kFrames; ++k) {
    const double at_s = kExposure_s * ((k + 0.5) / kFrames - 0.5);
    const Image<Radiance> one = renderer.render(motionOf(scene, 0, at_s)).radiance;
    for (size_t i = 0; i < sharp.size(); ++i)
      sharp[i] += static_cast<double>(one.pixels[i].g) / kFrames;
  }
  double bias = 0, square_sum = 0;
  for (size_t i = 0; i < sharp.size(); ++i) {
    const double d = static_cast<double>(blurred.pixels[i].g) - sharp[i];
    bias += d / static_cast<double>(sharp.size());
    square_sum += d * d / static_cast<double>(sharp.size());
  }
  EXPECT_LT(std::abs(bias), mean(blurred) / 255);
  EXPECT_LT(std::sqrt(square_sum), 4 * mean(blurred) / 255);
}

TEST(MovingObjects, FramesDependOnNothingBefore) {
  const Workshop workshop("moving_order");
  Scene scene = boxBeforeWall(workshop);
  moveBox(scene, std::make_shared<Sliding>(scene.objects[1].T_world_object));
  const auto prepared = lit(scene);
  const RayRenderer one(prepared, Camera(scene.camera), {RenderQuality::kStandard, 1});
  const RayRenderer two(prepared, Camera(scene.camera), {RenderQuality::kStandard, 2});
  one.render(motionOf(scene, 0.01, 0.3));
  const RenderedFrame a = one.render(motionOf(scene, 0.01)), b = two.render(motionOf(scene, 0.01));
  EXPECT_EQ(a.radiance.pixels, b.radiance.pixels);
  EXPECT_EQ(a.depth_m.pixels, b.depth_m.pixels);
  EXPECT_EQ(a.instance_id.pixels, b.instance_id.pixels);
}

}  // namespace
}  // namespace diorama
