// From light to 8 bits: each step against its model.
#include "sim/sensor.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cmath>

#include "core/errors.h"
#include "sim/exposure.h"
#include "sim/jpeg.h"
#include "sim/simulator.h"
#include "tests/sim/scene_support.h"

namespace diorama {
namespace {

using test::object;
using test::plainScene;
using test::square;
using test::Workshop;

const std::vector<Vector3d> kUnit = {Vector3d::Ones()};

CameraParameters pinhole(int width, int height) {
  return {CameraModel::kPinhole, width, height, 200, 200, (width - 1) / 2.0,
          (height - 1) / 2.0,    {}};
}

struct Statistics {
  double mean = 0, variance = 0;
};
template <class T>
Statistics statistics(const std::vector<T>& values) {
  double sum = 0, squares = 0;
  for (const T v : values) {
    sum += static_cast<double>(v);
    squares += static_cast<double>(v) * static_cast<double>(v);
  }
  const auto n = static_cast<double>(values.size());
  return {sum / n, squares / n - sum / n * (sum / n)};
}

TEST(Sensor, NoiseAtMidGrey) {
  EffectsOptions effects;
  effects.vignette = 0;
  const Sensor sensor(Camera(pinhole(200, 200)), effects, 7);
  const ResponseCurve response(effects);
  float grey = 0.01f;  // find the light that the curve turns into mid-grey
  while (response.evaluate(static_cast<double>(grey)) < 0.5) grey += 0.0005f;
  const Image<Radiance> even(200, 200, {grey, grey, grey});
  WorkerPool pool(2);
  const Image<Rgb8> frame = sensor.expose(even, kUnit, 5, pool);
  const Statistics seen = statistics(toGray(frame).pixels);
  const double deviation = std::sqrt(seen.variance);
  EXPECT_NEAR(seen.mean, 127.5, 2);
  EXPECT_GE(deviation, 2);
  EXPECT_LE(deviation, 4);
  // In linear light: photons and reading, as a part of the full well.
  const double light = static_cast<double>(grey);
  const double sigma = std::sqrt(light / effects.full_well_e +
                                 std::pow(effects.read_noise_e / effects.full_well_e, 2));
  const double step = 1e-4;
  const double slope =
      255 * (response.evaluate(light + step) - response.evaluate(light - step)) / (2 * step);
  const double weights = std::sqrt(0.299 * 0.299 + 0.587 * 0.587 + 0.114 * 0.114);
  EXPECT_NEAR(deviation / (sigma * slope * weights), 1, 0.05);
  EXPECT_EQ(sensor.expose(even, kUnit, 5, pool), frame);
  EXPECT_NE(sensor.expose(even, kUnit, 6, pool), frame);
}

// Variance against intensity: a line whose slope is one electron, from the read noise on; and the
// rounding to 8 bits.
TEST(Sensor, NoiseVarianceFollowsTheLight) {
  for (const double full_well_e : {2000.0, 9000.0}) {
    EffectsOptions effects;
    effects.vignette = 0;
    effects.response = "linear";
    effects.full_well_e = full_well_e;
    effects.read_noise_e = 20;
    const Sensor sensor(Camera(pinhole(300, 300)), effects, 3);
    WorkerPool pool(2);
    for (const float light : {0.06f, 0.1f, 0.2f, 0.4f, 0.6f, 0.85f}) {
      const Image<Rgb8> frame =
          sensor.expose(Image<Radiance>(300, 300, {light, light, light}), kUnit, 1, pool);
      std::vector<int> values;
      for (const Rgb8& p : frame.pixels) values.insert(values.end(), {p.r, p.g, p.b});
      const double electrons = static_cast<double>(light) * full_well_e + 20 * 20;
      const double expected = electrons * std::pow(255 / full_well_e, 2) + 1.0 / 12;
      const Statistics seen = statistics(values);
      EXPECT_NEAR(seen.mean, 255 * static_cast<double>(light), 0.15);
      EXPECT_NEAR(seen.variance / expected, 1, 0.05) << light;
    }
  }
}

TEST(Sensor, VignetteAndOrder) {
  EffectsOptions effects;
  effects.noise = false;
  effects.vignette = 0.5;
  const Sensor sensor(Camera(pinhole(101, 75)), effects, 1);
  WorkerPool pool(1);
  const Image<Rgb8> frame =
      sensor.expose(Image<Radiance>(101, 75, {0.1f, 0.2f, 0.3f}), kUnit, 0, pool);
  const Rgb8 center = frame(50, 37), corner = frame(0, 0);
  EXPECT_LT(center.r, center.g);
  EXPECT_LT(center.g, center.b);
  EXPECT_LT(corner.g, center.g - 20);
  EXPECT_EQ(frame(100, 74).g, corner.g);
}

TEST(Sensor, GainsOfChannelsAndRows) {
  EffectsOptions effects;
  effects.noise = false;
  effects.vignette = 0;
  effects.response = "linear";
  const Sensor sensor(Camera(pinhole(37, 3)), effects, 1);
  WorkerPool pool(1);
  const Image<Radiance> even(37, 3, {0.2f, 0.2f, 0.2f});
  const Image<Rgb8> frame = sensor.expose(even, {{1, 2, 3}, {0.5, 0.5, 0.5}, {4, 0, 10}}, 0, pool);
  for (int x = 0; x < 37; ++x) {
    ASSERT_EQ(frame(x, 0), (Rgb8{51, 102, 153}));
    ASSERT_NEAR(frame(x, 1).g, 25.5, 0.6);
    ASSERT_EQ(frame(x, 2), (Rgb8{204, 0, 255}));
  }
}

TEST(ResponseCurve, Kinds) {
  const auto at = [](const std::string& kind, double light) {
    EffectsOptions effects;
    effects.response = kind;
    effects.gamma = 2;
    return ResponseCurve(effects).evaluate(light);
  };
  EXPECT_NEAR(at("linear", 0.3), 0.3, 1e-12);
  EXPECT_NEAR(at("gamma", 0.25), 0.5, 1e-12);
  EXPECT_NEAR(at("srgb", 0.2140411), 0.5, 1e-6);
  EXPECT_NEAR(at("srgb", 0.001), 0.01292, 1e-9);
  EXPECT_GT(at("filmic", 0.3), at("srgb", 0.3));  // the shoulder
  for (const char* kind : {"linear", "gamma", "srgb", "filmic"}) {
    EXPECT_NEAR(at(kind, 1), 1, 1e-12);
    EXPECT_NEAR(at(kind, 0), 0, 1e-3);
    EXPECT_EQ(at(kind, 7), 1);
  }
}

// A meter that sees an even wall.
LightMeter wall(const std::function<float(double)>& radiance) {
  return [radiance](double time_s) {
    const float r = radiance(time_s);
    return Image<Radiance>(8, 8, {r, r, r});
  };
}

TEST(Exposure, IsMeteredOnceOrFixed) {
  Scene scene = plainScene();
  const auto gain = [&](float radiance, double time_s) {
    return ExposureControl(scene, wall([=](double) { return radiance; })).gainAt(time_s);
  };
  EXPECT_NEAR(gain(0.5f, 0) / gain(2, 0.7), 4, 1e-6);
  const double plain = gain(1, 0);
  scene.effects.exposure_gain = 0.25;
  EXPECT_NEAR(gain(1, 0.5) / plain, 0.25, 1e-9);
  scene.effects.exposure = "fixed";
  EXPECT_NEAR(gain(123, 0.5), 0.25, 1e-12);
}

TEST(Exposure, AutoFollowsWithALag) {
  Scene scene = plainScene();
  scene.duration_s = 6;
  scene.effects.exposure = "auto";
  scene.effects.auto_exposure_s = 0.5;
  const auto step = [](double time_s) { return time_s < 1.95 ? 1.f : 4.f; };
  const ExposureControl control(scene, wall(step));
  const double before = control.gainAt(1.9), after = control.gainAt(5.9);
  EXPECT_NEAR(control.gainAt(0), before, 1e-9 * before);
  EXPECT_NEAR(before / after, 4, 0.01);
  for (const double later_s : {0.2, 0.5, 1.0, 2.0})  // the step is seen at 2.0 s
    EXPECT_NEAR(std::log(before / control.gainAt(1.9 + later_s)) / std::log(4),
                1 - std::exp(-later_s / 0.5), 0.01);
  double last = before;
  for (double t = 1.9; t < 5.9; t += 0.013) {
    EXPECT_LE(control.gainAt(t), last);
    last = control.gainAt(t);
  }
  // Light that changes is metered like a scene that changes.
  scene.effects = parseScene(
                      "duration_s: 6\npath: {type: orbit, center: [0, 0, 0], radius_m: 1, "
                      "height_m: 0, rate_rad_s: 1}\ncamera: {width: 8, height: 8, fx: 5, fy: "
                      "5, cx: 3.5, cy: 3.5}\neffects: {exposure: auto, lighting: [[1.91, 1], "
                      "[1.99, 4]]}",
                      "s.yaml")
                      .effects;
  const ExposureControl lit(scene, wall([](double) { return 1.f; }));
  EXPECT_NEAR(lit.gainAt(2.7), control.gainAt(2.7), 1e-9);
}

LightCurve curve(const std::string& yaml) {
  YamlMap map = parseYaml("lighting: " + yaml, "l.yaml");
  LightCurve result;
  result.readYaml(map.require("lighting"));
  return result;
}

TEST(LightCurve, IsLinearBetweenItsTimes) {
  EXPECT_EQ(LightCurve().at(3), Vector3d::Ones());
  const LightCurve c = curve("[[1, 2], [3, 1, 0.5, 0]]");
  EXPECT_EQ(c.at(0), Vector3d::Constant(2));
  EXPECT_EQ(c.at(2), Vector3d(1.5, 1.25, 1));
  EXPECT_EQ(c.at(9), Vector3d(1, 0.5, 0));
  EXPECT_EQ(curve(c.toYaml()).toYaml(), c.toYaml());
  EXPECT_EQ(curve("[]").at(1), Vector3d::Ones());
  for (const char* bad : {"3", "[1]", "[[1]]", "[[0, 1], [0, 2]]", "[[0, -1]]", "[[0, 1, 2]]",
                          "[[0, .nan]]", "[[.inf, 1]]", "[[0, x]]", "{a: 1}"})
    EXPECT_THROW(curve(bad), InputError) << bad;
}

TEST(Lighting, DimsThePictureNotTheTruth) {
  const Workshop workshop("lighting");
  Scene scene = plainScene();
  scene.effects.response = "linear";
  scene.effects.exposure = "fixed";
  scene.effects.exposure_gain = 0.9;
  scene.ambient = 1;
  scene.objects = {object("wall", workshop.write("w.obj", square(3)), Vector3d(1, 0, 0))};
  const FrameAndTruth bright = Simulator(scene, {RenderQuality::kDraft, 1}).read(15);
  scene.effects.lighting = curve("[[0, 1], [1, 0]]");
  const FrameAndTruth dim = Simulator(scene, {RenderQuality::kDraft, 1}).read(15);
  ASSERT_GT(bright.frame.rgb(80, 60).g, 100);
  EXPECT_NEAR(dim.frame.rgb(80, 60).g, bright.frame.rgb(80, 60).g / 2.0, 1);
  EXPECT_EQ(dim.truth->depth_m, bright.truth->depth_m);
  // A rolling shutter sees the light of each row's time.
  scene.row_time_s = 2e-4;
  const Image<Rgb8> rows = Simulator(scene, {RenderQuality::kDraft, 1}).read(15).frame.rgb;
  EXPECT_NEAR(rows(80, 0).g - rows(80, 119).g, bright.frame.rgb(80, 60).g * 119 * 2e-4, 1.1);
}

TEST(Jpeg, CostsWhatItsQualitySays) {
  Image<Rgb8> picture(64, 48);
  const Random random(1, RandomStream::kTest);
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) {
      const auto noise =
          static_cast<uint8_t>(random.bits(0, static_cast<uint64_t>(y * 64 + x))[0] & 15);
      picture(x, y) = {static_cast<uint8_t>(x * 3 + noise), static_cast<uint8_t>(y * 4 + noise),
                       static_cast<uint8_t>(x / 16 % 2 ? 200 : 40)};
    }
  const auto rms = [&](int quality) {
    const Image<Rgb8> coded = throughJpeg(picture, quality);
    std::vector<int> differences;
    for (size_t i = 0; i < picture.pixels.size(); ++i)
      differences.push_back(coded.pixels[i].g - picture.pixels[i].g);
    const Statistics s = statistics(differences);
    EXPECT_LT(std::abs(s.mean), 1);
    return std::sqrt(s.variance);
  };
  EXPECT_LT(rms(95), 3);
  EXPECT_GT(rms(20), 2 * rms(95));
  EXPECT_LT(rms(20), 12);
  EXPECT_EQ(throughJpeg(picture, 50), throughJpeg(picture, 50));
}

// With everything on: frames of a part are those of the whole, on any number of threads.
TEST(Sensor, EffectsDependOnTheSceneAlone) {
  const Workshop workshop("effects");
  Scene scene = plainScene();
  scene.path = makeSplinePath(
      {{0, lookAt({0, 0.1, 0}, {1, 0.1, 0})}, {1, lookAt({0, -0.3, 0.1}, {1, 0, 0})}});
  scene.objects = {object("a", workshop.write("a.obj", square(0.3)), Vector3d(1, 0, 0))};
  scene.effects = {};
  scene.effects.exposure = "auto";
  scene.effects.lighting = curve("[[0, 1], [1, 3, 2, 1]]");
  scene.effects.jpeg_quality = 80;
  scene.row_time_s = 1e-4;
  Simulator first(scene, {RenderQuality::kStandard, 1}),
      second(scene, {RenderQuality::kStandard, 2});
  first.read(3);
  const Image<Rgb8> picture = first.read(17).frame.rgb;
  EXPECT_EQ(picture, second.read(17).frame.rgb);
  scene.effects.jpeg_quality = 0;
  EXPECT_NE(picture, Simulator(scene, {RenderQuality::kStandard, 1}).read(17).frame.rgb);
}

TEST(Effects, AreReadAndChecked) {
  const std::string scene =
      "duration_s: 1\npath: {type: orbit, center: [0, 0, 0], radius_m: 1, "
      "height_m: 0, rate_rad_s: 1}\ncamera: {width: 8, height: 8, fx: 5, fy: 5, "
      "cx: 3.5, cy: 3.5}\neffects: ";
  const Scene read = parseScene(scene +
                                    "{exposure: auto, exposure_gain: 0.5, response: srgb, "
                                    "jpeg_quality: 70, lighting: [[0, 1], [2, 0.5]]}",
                                "s.yaml");
  EXPECT_EQ(read.effects.exposure, "auto");
  EXPECT_EQ(read.effects.response, "srgb");
  EXPECT_EQ(read.effects.jpeg_quality, 70);
  EXPECT_EQ(read.effects.lighting.at(1), Vector3d::Constant(0.75));
  EXPECT_THAT(describeScene(read), testing::HasSubstr("exposure: auto"));
  const Scene again = parseScene(scene + "{lighting: [[0, 1], [2, 0.4]]}", "s.yaml");
  EXPECT_NE(describeScene(again), describeScene(parseScene(scene + "{}", "s.yaml")));
  for (const char* bad :
       {"{exposure: automatic}", "{response: log}", "{jpeg_quality: 101}", "{exposure_gain: 0}",
        "{auto_exposure_s: 0}", "{gamma: -1}", "{lighting: [[0, 1], [0, 1]]}"})
    EXPECT_THROW(parseScene(scene + bad, "s.yaml"), InputError) << bad;
}

}  // namespace
}  // namespace diorama
