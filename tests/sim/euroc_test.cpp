#include <gmock/gmock.h>

#include <cmath>

#include "core/text.h"
#include "mutator.h"
#include "sim/euroc_reader.h"
#include "sim/imu.h"
#include "sim/png_encoder.h"
#include "sim/sequence_writer.h"
#include "small_scene.h"

namespace diorama {
namespace {

namespace fs = std::filesystem;
using testing::errorLine;
using ::testing::HasSubstr;
using ::testing::StartsWith;

class Euroc : public testing::SmallScene {
 protected:
  void SetUp() override {
    SmallScene::SetUp();
    scene_ = loadScene(folder_ / "scene.yaml");
    SequenceWriter writer(folder_ / "seq", scene_, {0, 5, {SequenceFormat::kEuroc}});
    for (int k = 0; k < 5; ++k) {
      Frame frame;
      frame.index = k;
      frame.timestamp_ns = scene_.timestampNs(k);
      frame.rgb = Image<Rgb8>(64, 48, {uint8_t(20 * k), 100, 200});
      frame.gray = toGray(frame.rgb);
      GroundTruth truth;
      truth.T_world_camera = scene_.T_world_camera(k);
      for (size_t i : {0u, 2u})
        truth.objects.push_back(
            {scene_.objects[i].name, scene_.objects[i].T_world_object, 0, 0, 0, {}, {}});
      writer.write(frame, truth);
    }
    writer.finish();
    mav0_ = folder_ / "seq/euroc/mav0";
  }

  Scene scene_;
  fs::path mav0_;
};

TEST_F(Euroc, FilesKeepToTheLetterOfTheFormat) {
  const std::string images = readFile(mav0_ / "cam0/data.csv");
  EXPECT_THAT(images, StartsWith("#timestamp [ns],filename\n0,0.png\n33333000,33333000.png\n"));
  const std::string imu = readFile(mav0_ / "imu0/data.csv");
  EXPECT_THAT(imu, StartsWith("#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z "
                              "[rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m "
                              "s^-2]\n0,"));
  const std::string truth = readFile(mav0_ / "state_groundtruth_estimate0/data.csv");
  EXPECT_THAT(truth, StartsWith("#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], "
                                "q_RS_x [], q_RS_y [], q_RS_z [], v_RS_R_x [m s^-1]"));
  const size_t line = truth.find("\n0,") + 1;
  const std::vector<std::string_view> fields =
      split(std::string_view(truth).substr(line, truth.find('\n', line) - line), ',');
  ASSERT_EQ(fields.size(), 17u);
  const SE3 pose = scene_.T_world_camera(0);
  EXPECT_EQ(parseNumber(fields[1]), pose.translation.x());
  EXPECT_EQ(parseNumber(fields[4]), pose.rotation.w()) << "w first";
  EXPECT_EQ(parseNumber(fields[7]), pose.rotation.z());
  for (const std::string& text : {images, imu, truth}) {
    EXPECT_EQ(text.find(" \n"), std::string::npos);
    EXPECT_EQ(text.find('\r'), std::string::npos);
  }
  EXPECT_EQ(std::count(imu.begin(), imu.end(), '\n'), 1 + 28) << "0 to 135 ms in steps of 5 ms";
  const std::string camera = readFile(mav0_ / "cam0/sensor.yaml");
  for (const char* line_of :
       {"sensor_type: camera\n", "resolution: [64, 48]\n", "rate_hz: 30\n",
        "intrinsics: [50, 51, 31.5, 23.5] #fu, fv, cu, cv\n",
        "distortion_model: radial-tangential\n", "distortion_coefficients: [-0.1, 0.02, 0, 0]\n"})
    EXPECT_THAT(camera, HasSubstr(line_of));
}

TEST_F(Euroc, ReadsBackWhatWasWritten) {
  for (const fs::path& path : {folder_ / "seq", folder_ / "seq/euroc", mav0_})
    EXPECT_EQ(findEuroc(path).value_or("").lexically_normal(), mav0_) << path;
  EXPECT_FALSE(findEuroc(folder_).has_value());
  EurocReader reader(mav0_);
  EXPECT_EQ(reader.name(), "euroc");
  EXPECT_EQ(reader.frameCount(), 5);
  EXPECT_EQ(reader.camera().parameters().distortion, scene_.camera.distortion);
  for (int k = 0; k < 5; ++k) {
    const FrameAndTruth read = reader.read(k);
    EXPECT_EQ(read.frame.timestamp_ns, scene_.timestampNs(k));
    EXPECT_TRUE(read.frame.rgb.empty());
    EXPECT_EQ(read.frame.gray(5, 5), toGray(Image<Rgb8>(1, 1, {uint8_t(20 * k), 100, 200}))(0, 0));
    ASSERT_TRUE(read.truth.has_value()) << k;
    // Between two samples of the truth.
    EXPECT_LT((read.truth->T_world_camera.matrix() - scene_.T_world_camera(k).matrix()).norm(),
              5e-4);
  }
}

TEST_F(Euroc, TheCameraMaySitElsewhereOnTheBody) {
  std::string sensor = readFile(mav0_ / "cam0/sensor.yaml");
  const std::string row = "1.0, 0.0, 0.0, 0.0,";
  sensor.replace(sensor.find(row), row.size(), "1.0, 0.0, 0.0, 0.25,");
  writeFileAtomically(mav0_ / "cam0/sensor.yaml", "%YAML:1.0\n" + sensor);
  EurocReader reader(mav0_);
  const SE3 expected = scene_.T_world_camera(0) * SE3{Eigen::Quaterniond::Identity(), {0.25, 0, 0}};
  EXPECT_LT((reader.read(0).truth->T_world_camera.matrix() - expected.matrix()).norm(), 1e-9);
}

TEST_F(Euroc, WhatIsWrongIsSaidWithItsPlace) {
  const auto open = [&] { EurocReader reader(mav0_); };
  const std::vector<std::tuple<std::string, std::string, std::string>> bad = {
      {"cam0/data.csv", "#timestamp [ns],filename\n5,a.png\n5,b.png\n", "data.csv:3: the times"},
      {"cam0/data.csv", "x,a.png\n", "data.csv:1: the timestamp"},
      {"cam0/data.csv", "#\n", "lists no images"},
      {"cam0/sensor.yaml", "resolution: [1]\nintrinsics: [1, 1, 1, 1]\n", "sensor.yaml:1:13"},
      {"cam0/sensor.yaml", "resolution: [64, 48]\nintrinsics: [1, 1]\n", "[fu, fv, cu, cv]"},
      {"state_groundtruth_estimate0/data.csv", "1,2,3\n", "data.csv:1: expected"}};
  for (const auto& [file, content, message] : bad) {
    const std::string good = readFile(mav0_ / file);
    writeFileAtomically(mav0_ / file, content);
    EXPECT_THAT(errorLine(open, kExitBadData), HasSubstr(message));
    writeFileAtomically(mav0_ / file, good);
  }
  fs::remove(mav0_ / "cam0/data.csv");
  errorLine(open, kExitMissingInput);
}

TEST_F(Euroc, MutatedFiles) {
  const std::vector<fs::path> files = {mav0_ / "cam0/sensor.yaml", mav0_ / "cam0/data.csv",
                                       mav0_ / "state_groundtruth_estimate0/data.csv",
                                       mav0_ / "state_groundtruth_estimate0/sensor.yaml"};
  std::vector<std::string> good;
  for (const fs::path& file : files) good.push_back(readFile(file));
  int accepted = 0;
  for (uint32_t seed = 0; seed < 600; ++seed) {
    const size_t which = seed % files.size();
    const std::string text = testing::Mutator(3000 + seed).mutate(good[which]);
    writeFileAtomically(files[which], text);
    accepted += testing::survives([&] { EurocReader(mav0_).read(0); }, text);
    writeFileAtomically(files[which], good[which]);
  }
  EXPECT_GT(accepted, 20);
  EXPECT_LT(accepted, 580);
}

ImuOptions withoutNoise() {
  ImuOptions options;
  options.gyroscope_noise_density = options.gyroscope_random_walk = 0;
  options.accelerometer_noise_density = options.accelerometer_random_walk = 0;
  return options;
}

TEST(Imu, IntegratesToThePath) {
  const auto path = makeSplinePath({{-0.5, lookAt({0, 0, 1}, {1, 0, 1})},
                                    {0.3, lookAt({0.2, 0.1, 1.1}, {1, 0.3, 1})},
                                    {0.8, lookAt({0.3, -0.1, 1}, {1, 0, 0.8}, 0.4)},
                                    {1.5, lookAt({0.1, 0, 1}, {1, 0, 1})}});
  const std::vector<ImuSample> samples = simulateImu(*path, 1, withoutNoise(), 1, 0, 1'000'000'000);
  ASSERT_EQ(samples.size(), 201u);
  SE3 T = samples.front().T_world_camera;
  Vector3d v = samples.front().velocity;
  for (size_t i = 0; i + 1 < samples.size(); ++i) {
    const double dt = 0.005;
    const Vector3d w = (samples[i].gyroscope + samples[i + 1].gyroscope) / 2;
    const Vector3d before = T.rotation * samples[i].accelerometer;
    T.rotation = T.rotation * expSO3(dt * w);
    const Vector3d a =
        (before + T.rotation * samples[i + 1].accelerometer) / 2 - Vector3d(0, 0, 9.81);
    T.translation += dt * v + dt * dt / 2 * a;
    v += dt * a;
  }
  const ImuSample& last = samples.back();
  EXPECT_LT((T.translation - last.T_world_camera.translation).norm(), 1e-4);
  EXPECT_LT(angleBetween(T.rotation, last.T_world_camera.rotation), 1e-4);
  EXPECT_LT((v - last.velocity).norm(), 1e-3);
}

TEST(Imu, AtRestItFeelsTheDeskPushUpwards) {
  const auto path = makeSplinePath({{0, lookAt({0, 0, 1}, {1, 0, 1})}});
  const ImuSample sample = simulateImu(*path, 1, withoutNoise(), 1, 0, 0).front();
  EXPECT_LT((sample.accelerometer - Vector3d(0, -9.81, 0)).norm(), 1e-9) << "y is down";
  EXPECT_LT(sample.gyroscope.norm(), 1e-12);
}

TEST(Imu, NoiseHasItsDensityAndABiasWalks) {
  const auto path = makeSplinePath({{0, lookAt({0, 0, 1}, {1, 0, 1})}});
  ImuOptions options;
  const int64_t minute_ns = 60'000'000'000;
  const std::vector<ImuSample> samples = simulateImu(*path, 61, options, 4, 0, minute_ns);
  double gyro = 0, accel = 0, step = 0;
  for (size_t i = 1; i < samples.size(); ++i) {
    gyro += (samples[i].gyroscope - samples[i].gyroscope_bias).squaredNorm();
    accel += (samples[i].accelerometer - samples[i].accelerometer_bias - Vector3d(0, -9.81, 0))
                 .squaredNorm();
    step += (samples[i].gyroscope_bias - samples[i - 1].gyroscope_bias).squaredNorm();
  }
  const double n = 3 * static_cast<double>(samples.size() - 1);
  EXPECT_NEAR(std::sqrt(gyro / n), 1.6968e-4 * std::sqrt(200), 3e-5);
  EXPECT_NEAR(std::sqrt(accel / n), 2e-3 * std::sqrt(200), 3e-4);
  EXPECT_NEAR(std::sqrt(step / n), 1.9393e-5 / std::sqrt(200), 2e-8);
  // A part of the range has the same samples.
  const std::vector<ImuSample> part =
      simulateImu(*path, 61, options, 4, 30'000'000'000, 31'000'000'000);
  EXPECT_EQ(part.front().timestamp_ns, 30'000'000'000);
  EXPECT_EQ(part.front().gyroscope, samples[6000].gyroscope);
  EXPECT_EQ(part.back().accelerometer_bias, samples[6200].accelerometer_bias);
}

}  // namespace
}  // namespace diorama
