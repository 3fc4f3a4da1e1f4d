#include "sim/simulator.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>

#include "core/errors.h"
#include "sim/sensor.h"
#include "tests/sim/scene_support.h"

namespace diorama {
namespace {

using test::object;
using test::plainScene;
using test::square;
using test::Workshop;

// A camera that drifts sideways past two squares, noisy and blurred.
Scene movingScene(const Workshop& workshop) {
  Scene scene = plainScene();
  scene.path = makeSplinePath({{0, lookAt(Vector3d(0, 0.1, 0), Vector3d(1, 0.1, 0))},
                               {1, lookAt(Vector3d(0, -0.3, 0.1), Vector3d(1, 0, 0))}});
  scene.effects = {};
  scene.objects = {object("a", workshop.write("a.obj", square(0.3)), Vector3d(1, 0, 0)),
                   object("b", workshop.write("b.obj", square(0.1)), Vector3d(0.8, 0.1, 0), false)};
  return scene;
}

TEST(Simulator, FramesDependOnNothingButTheirNumber) {
  const Workshop workshop("frames");
  const Scene scene = movingScene(workshop);
  Simulator first(scene, {RenderQuality::kStandard, 1}),
      second(scene, {RenderQuality::kStandard, 2});
  first.read(3);
  const FrameAndTruth a = first.read(17), b = second.read(17);
  EXPECT_EQ(a.frame.rgb, b.frame.rgb);
  EXPECT_EQ(a.frame.gray, b.frame.gray);
  EXPECT_EQ(a.truth->depth_m, b.truth->depth_m);
  EXPECT_EQ(a.truth->instance_id, b.truth->instance_id);
  EXPECT_EQ(a.frame.timestamp_ns, scene.timestampNs(17));
  ASSERT_EQ(a.truth->objects.size(), 1u);  // only what is tracked
  EXPECT_EQ(a.truth->objects[0].name, "a");
  EXPECT_EQ(a.truth->objects[0].mask, b.truth->objects[0].mask);
  EXPECT_NE(first.read(18).frame.rgb, a.frame.rgb);
}

TEST(Simulator, MissingMeshIsReported) {
  Scene scene = plainScene();
  scene.objects = {object("none", "/nonexistent/none.obj", Vector3d(1, 0, 0))};
  EXPECT_THROW(Simulator{scene}, MissingInputError);
}

double standardDeviation(const Image<uint8_t>& image, double* mean) {
  double sum = 0, squares = 0;
  for (const uint8_t p : image.pixels) {
    sum += p;
    squares += p * p;
  }
  const auto n = static_cast<double>(image.pixels.size());
  *mean = sum / n;
  return std::sqrt(squares / n - *mean * *mean);
}

TEST(Sensor, NoiseAtMidGrey) {
  const CameraParameters parameters{CameraModel::kPinhole, 200, 200, 200, 200, 99.5, 99.5, {}};
  EffectsOptions effects;
  effects.vignette = 0;
  const Sensor sensor(Camera(parameters), effects, 1, 7);
  float grey = 0.01f;  // find the light that the curve turns into mid-grey
  while (ResponseCurve::evaluate(static_cast<double>(grey)) / ResponseCurve::evaluate(1) < 0.5)
    grey += 0.0005f;
  const Image<Radiance> even(200, 200, {grey, grey, grey});
  WorkerPool pool(2);
  const Image<Rgb8> frame = sensor.expose(even, 5, pool);
  double mean = 0;
  const double deviation = standardDeviation(toGray(frame), &mean);
  EXPECT_NEAR(mean, 127.5, 2);
  EXPECT_GE(deviation, 2);
  EXPECT_LE(deviation, 4);
  // In linear light: photons and reading, as a part of the full well.
  const double light = static_cast<double>(grey);
  const double sigma = std::sqrt(light / effects.full_well_e +
                                 std::pow(effects.read_noise_e / effects.full_well_e, 2));
  const double step = 1e-4;
  const double slope =
      255 / ResponseCurve::evaluate(1) *
      (ResponseCurve::evaluate(light + step) - ResponseCurve::evaluate(light - step)) / (2 * step);
  const double weights = std::sqrt(0.299 * 0.299 + 0.587 * 0.587 + 0.114 * 0.114);
  EXPECT_NEAR(deviation / (sigma * slope * weights), 1, 0.05);
  EXPECT_EQ(sensor.expose(even, 5, pool), frame);
  EXPECT_NE(sensor.expose(even, 6, pool), frame);
}

TEST(Sensor, VignetteAndOrder) {
  const CameraParameters parameters{CameraModel::kPinhole, 101, 75, 100, 100, 50, 37, {}};
  EffectsOptions effects;
  effects.noise = false;
  effects.vignette = 0.5;
  const Sensor sensor(Camera(parameters), effects, 1, 1);
  WorkerPool pool(1);
  const Image<Rgb8> frame = sensor.expose(Image<Radiance>(101, 75, {0.1f, 0.2f, 0.3f}), 0, pool);
  const Rgb8 center = frame(50, 37), corner = frame(0, 0);
  EXPECT_LT(center.r, center.g);
  EXPECT_LT(center.g, center.b);
  EXPECT_LT(corner.g, center.g - 20);
  EXPECT_EQ(frame(100, 74).g, corner.g);
}

}  // namespace
}  // namespace diorama
