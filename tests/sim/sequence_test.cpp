#include <gmock/gmock.h>

#include <algorithm>
#include <ctime>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <thread>

#include "core/measurements_io.h"
#include "core/random.h"
#include "core/sha256.h"
#include "sim/mesh_import.h"
#include "sim/png_encoder.h"
#include "sim/sequence_reader.h"
#include "sim/sequence_writer.h"
#include "sim/simulated_odometry.h"
#include "small_scene.h"

namespace diorama {
namespace {

namespace fs = std::filesystem;
using testing::errorLine;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// A made-up picture and truth for one frame.
FrameAndTruth makeFrame(const Scene& scene, int k) {
  const Random random(3, RandomStream::kTest);
  const int width = scene.camera.width, height = scene.camera.height;
  FrameAndTruth made;
  made.frame.index = k;
  made.frame.timestamp_ns = scene.timestampNs(k);
  made.frame.rgb = Image<Rgb8>(width, height);
  GroundTruth truth;
  truth.timestamp_ns = made.frame.timestamp_ns;
  truth.T_world_camera = scene.T_world_camera(k);
  truth.depth_m = Image<float>(width, height);
  truth.instance_id = Image<uint16_t>(width, height);
  Image<uint8_t> mask(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const auto b = random.bits(static_cast<uint32_t>(k), static_cast<uint64_t>(y * width + x));
      made.frame.rgb(x, y) = {static_cast<uint8_t>(x * 2 + (b[0] & 7)),
                              static_cast<uint8_t>(y * 2 + (b[1] & 7)),
                              static_cast<uint8_t>(90 + (b[2] & 7))};
      truth.depth_m(x, y) = static_cast<float>(0.5 + 0.01 * x + 0.02 * k);
      const bool inside = x > width / 4 && x < width / 2 && y > height / 4;
      truth.instance_id(x, y) = inside              ? uint16_t{1}
                                : x > 3 * width / 4 ? uint16_t{2}
                                                    : uint16_t{0};
      mask(x, y) = inside ? 255 : 0;
    }
  truth.depth_m(0, 0) = 0;
  truth.depth_m(1, 0) = 13.2f;
  made.frame.gray = toGray(made.frame.rgb);
  for (const SceneObject& object : scene.objects) {
    if (!object.tracked) continue;
    truth.objects.push_back({object.name, object.T_world_object, 1000 + k, 800, 500, mask});
  }
  made.truth = std::move(truth);
  return made;
}

class Sequence : public testing::SmallScene {
 protected:
  void SetUp() override {
    SmallScene::SetUp();
    scene_ = loadScene(folder_ / "scene.yaml");
  }
  void write(const std::string& name, SequenceWriterOptions options = {}) {
    SequenceWriter writer(folder_ / name, scene_, options);
    const int end = options.end_frame < 0 ? scene_.frameCount() : options.end_frame;
    for (int k = options.first_frame; k < end; ++k) {
      const FrameAndTruth made = makeFrame(scene_, k);
      writer.write(made.frame, *made.truth);
    }
    writer.finish();
  }
  std::string text(const std::string& file) const { return readFile(folder_ / file); }

  Scene scene_;
};

std::string encodedOfSize(int width, int height) {
  return encodePng(Image<uint8_t>(width, height));
}

std::vector<std::string> filesIn(const fs::path& folder) {
  std::vector<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file())
      files.push_back(entry.path().lexically_relative(folder).generic_string());
  std::sort(files.begin(), files.end());
  return files;
}

TEST_F(Sequence, ReadsBackWhatWasWritten) {
  write("seq");
  SequenceReader reader(folder_ / "seq");
  EXPECT_EQ(reader.name(), "seq");
  EXPECT_EQ(reader.frameCount(), 6);
  EXPECT_EQ(reader.camera().parameters().distortion, scene_.camera.distortion);
  EXPECT_EQ(reader.camera().fy(), scene_.camera.fy);
  for (int k = 0; k < 6; ++k) {
    const FrameAndTruth made = makeFrame(scene_, k), read = reader.read(k);
    EXPECT_EQ(read.frame.index, k);
    EXPECT_EQ(read.frame.timestamp_ns, made.frame.timestamp_ns);
    EXPECT_EQ(read.frame.rgb, made.frame.rgb);
    EXPECT_EQ(read.frame.gray, made.frame.gray);
    ASSERT_TRUE(read.truth.has_value());
    EXPECT_EQ(read.truth->T_world_camera.matrix(), made.truth->T_world_camera.matrix());
    EXPECT_EQ(read.truth->instance_id, made.truth->instance_id);
    ASSERT_EQ(read.truth->objects.size(), 2u);
    EXPECT_EQ(read.truth->objects[1].name, "small");
    EXPECT_EQ(read.truth->objects[0].T_world_object.matrix(),
              made.truth->objects[0].T_world_object.matrix());
    EXPECT_EQ(read.truth->objects[0].px_all, 1000 + k);
    EXPECT_EQ(read.truth->objects[0].px_visible, 500);
    EXPECT_EQ(read.truth->objects[0].mask, made.truth->objects[0].mask);
    EXPECT_EQ(read.truth->depth_m(0, 0), 0);
    EXPECT_EQ(read.truth->depth_m(1, 0), 0) << "beyond 13.1 m";
    EXPECT_NEAR(read.truth->depth_m(40, 9), made.truth->depth_m(40, 9), 1.01e-4);
  }
}

TEST_F(Sequence, ObjectsComeWithModelPoseAndSymmetries) {
  write("seq");
  SequenceReader reader(folder_ / "seq");
  ASSERT_EQ(reader.objects().size(), 2u);
  const SequenceObject &box = reader.objects()[0], &small = reader.objects()[1];
  EXPECT_EQ(box.name, "box");
  EXPECT_EQ(box.symmetries.axis, Vector3d(0, 0, 1));
  const SE3 expected = scene_.T_world_camera(0).inverse() * scene_.objects[0].T_world_object;
  ASSERT_TRUE(box.initial_T_camera_object.has_value());
  EXPECT_LT((box.initial_T_camera_object->matrix() - expected.matrix()).norm(), 1e-15);
  EXPECT_EQ(small.scale, 0.5);
  EXPECT_TRUE(small.y_up);
  fs::rename(folder_ / "seq", folder_ / "elsewhere");
  fs::remove(folder_ / "box.obj");
  SequenceReader moved(folder_ / "elsewhere");
  EXPECT_EQ(importMesh(moved.objects()[0].model).triangles.size(), 12u);
}

TEST_F(Sequence, TextFilesKeepToTheLetterOfTheirFormats) {
  write("seq");
  EXPECT_THAT(text("seq/rgb.txt"),
              StartsWith("# color images\n# scene: scene\n# timestamp filename\n"
                         "0.000000 rgb/000000.png\n0.033333 rgb/000001.png\n"));
  EXPECT_THAT(text("seq/depth.txt"), HasSubstr("\n0.166667 depth/000005.png\n"));
  for (const char* file : {"rgb.txt", "depth.txt", "groundtruth.txt", "objects/box.txt"}) {
    const std::string content = text(std::string("seq/") + file);
    EXPECT_EQ(std::count(content.begin(), content.end(), '#'), 3) << file;
    EXPECT_EQ(std::count(content.begin(), content.end(), '\n'), 9) << file;
    EXPECT_EQ(content.find(" \n"), std::string::npos) << file;
    EXPECT_EQ(content.find('\r'), std::string::npos) << file;
  }
  const std::string truth = text("seq/groundtruth.txt");
  const size_t line = truth.find("\n0.000000 ") + 1;
  EXPECT_EQ(std::count(truth.begin() + static_cast<long>(line),
                       truth.begin() + static_cast<long>(truth.find('\n', line)), ' '),
            7);
  EXPECT_THAT(text("seq/visibility.csv"),
              StartsWith("frame,object,px_all,px_valid,px_visible,visible_fraction\n"
                         "0,box,1000,800,500,0.5\n0,small,1000,800,500,0.5\n"));
  EXPECT_EQ(text("seq/instances.csv"),
            "id,name,model,tracked\n1,box,box,1\n2,other,box,0\n3,small,box,1\n");
  EXPECT_TRUE(fs::exists(folder_ / "seq/mask/000005_000001.png"));
  const cv::Mat visible =
      cv::imread((folder_ / "seq/mask_visib/000000_000000.png").string(), cv::IMREAD_UNCHANGED);
  EXPECT_EQ(visible.type(), CV_8UC1);
  EXPECT_EQ(visible.at<uint8_t>(20, 20), 255);
  EXPECT_EQ(visible.at<uint8_t>(20, 60), 0);
  const cv::Mat depth =
      cv::imread((folder_ / "seq/depth/000000.png").string(), cv::IMREAD_UNCHANGED);
  EXPECT_EQ(depth.type(), CV_16UC1);
  EXPECT_EQ(depth.at<uint16_t>(5, 10), 3000);
}

TEST_F(Sequence, ManifestListsEveryFileWithItsSum) {
  write("seq");
  std::vector<std::string> listed{"manifest.csv"};
  std::ifstream manifest(folder_ / "seq/manifest.csv");
  std::string line;
  std::getline(manifest, line);
  EXPECT_EQ(line, "file,sha256");
  while (std::getline(manifest, line)) {
    const std::string file = line.substr(0, line.find(','));
    EXPECT_EQ(line.substr(line.find(',') + 1), sha256(text("seq/" + file))) << file;
    listed.push_back(file);
  }
  std::sort(listed.begin(), listed.end());
  EXPECT_EQ(listed, filesIn(folder_ / "seq"));
}

TEST_F(Sequence, SameBytesInAnyOrderWithThreadsAndAfterAnInterruption) {
  write("seq");
  {
    SequenceWriter writer(folder_ / "again", scene_);
    for (int k : {5, 0, 3}) {
      const FrameAndTruth made = makeFrame(scene_, k);
      writer.write(made.frame, *made.truth);
    }
    EXPECT_FALSE(fs::exists(folder_ / "again/manifest.csv"));
  }
  fs::remove(folder_ / "again/id/000003.png");  // as if the disk had lost one
  SequenceWriter writer(folder_ / "again", scene_);
  EXPECT_TRUE(writer.has(0));
  EXPECT_TRUE(writer.has(5));
  EXPECT_FALSE(writer.has(1));
  EXPECT_FALSE(writer.has(3));
  std::vector<std::thread> threads;
  for (int k = 0; k < 6; ++k) {
    if (writer.has(k)) continue;
    threads.emplace_back([&, k] {
      const FrameAndTruth made = makeFrame(scene_, k);
      writer.write(made.frame, *made.truth);
    });
  }
  for (std::thread& thread : threads) thread.join();
  writer.finish();
  EXPECT_EQ(filesIn(folder_ / "seq"), filesIn(folder_ / "again"));
  for (const std::string& file : filesIn(folder_ / "seq"))
    EXPECT_EQ(sha256(text("seq/" + file)), sha256(text("again/" + file))) << file;
}

TEST_F(Sequence, ARangeKeepsItsNumbersAndTimes) {
  write("seq");
  write("part", {2, 5});
  SequenceReader reader(folder_ / "part");
  ASSERT_EQ(reader.frameCount(), 3);
  EXPECT_EQ(reader.frameNumber(0), 2);
  EXPECT_EQ(reader.timestampNs(0), scene_.timestampNs(2));
  EXPECT_EQ(reader.read(1).truth->objects[0].px_all, 1003);
  for (const char* file : {"rgb/000003.png", "depth/000003.png", "id/000003.png"})
    EXPECT_EQ(text(std::string("seq/") + file), text(std::string("part/") + file));
  EXPECT_FALSE(fs::exists(folder_ / "part/rgb/000005.png"));
  EXPECT_EQ(readMeasurements(folder_ / "part/odometry.csv").odometry.size(), 2u);
}

TEST_F(Sequence, OdometryIsTheSensorsRecord) {
  write("seq");
  SequenceReader reader(folder_ / "seq");
  ASSERT_TRUE(reader.odometryFile().has_value());
  const Measurements recorded = readMeasurements(*reader.odometryFile());
  ASSERT_EQ(recorded.odometry.size(), 5u);
  SimulatedOdometry sensor(trueCameraPath(scene_), scene_.odometry, scene_.seed);
  for (int k = 0; k < 6; ++k) {
    const auto measured = sensor.track(reader.read(k).frame);
    if (k == 0) continue;
    const OdometryMeasurement& m = recorded.odometry[static_cast<size_t>(k - 1)];
    EXPECT_EQ(m.T_from_to.matrix(), measured->T_from_to.matrix());
    EXPECT_EQ(m.covariance, measured->covariance);
    EXPECT_EQ(m.to_ns, measured->to_ns);
  }
}

TEST_F(Sequence, WithoutTruthTheFramesAreTheSame) {
  write("seq");
  const Frame with = SequenceReader(folder_ / "seq").read(2).frame;
  for (const char* name : {"groundtruth.txt", "depth.txt", "visibility.csv", "instances.csv",
                           "objects", "depth", "id", "mask", "mask_visib", "manifest.csv"})
    fs::remove_all(folder_ / "seq" / name);
  SequenceReader reader(folder_ / "seq");
  const FrameAndTruth without = reader.read(2);
  EXPECT_FALSE(without.truth.has_value());
  EXPECT_EQ(without.frame.rgb, with.rgb);
  EXPECT_EQ(without.frame.gray, with.gray);
  EXPECT_EQ(without.frame.timestamp_ns, with.timestamp_ns);
  EXPECT_TRUE(reader.trueCameraPath().poses.empty());
}

TEST_F(Sequence, GreyAndSixteenBitImagesByHand) {
  createFolder(folder_ / "hand/images");
  writeFileAtomically(folder_ / "hand/cube.obj", testing::boxObj(1, 1, 1));
  writeFileAtomically(
      folder_ / "hand/sequence.yaml",
      "camera: {model: pinhole, width: 8, height: 6, fx: 9, fy: 9, cx: 3.5, cy: 2.5}\n"
      "images: list.txt\nobjects: [{name: cube, model: cube.obj}]\n");
  writeFileAtomically(
      folder_ / "hand/list.txt",
      "0.1 images/a b.png\n0.2 images/wide.png\n0.3 images/c.jpg\n0.4 images/d.pgm");
  const cv::Mat grey(6, 8, CV_8UC1, cv::Scalar(77)), wide(6, 8, CV_16UC1, cv::Scalar(77 * 257));
  cv::imwrite((folder_ / "hand/images/a b.png").string(), grey);
  cv::imwrite((folder_ / "hand/images/wide.png").string(), wide);
  cv::imwrite((folder_ / "hand/images/c.jpg").string(), grey);
  cv::imwrite((folder_ / "hand/images/d.pgm").string(), grey);
  SequenceReader reader(folder_ / "hand/sequence.yaml");
  EXPECT_EQ(reader.name(), "hand");
  ASSERT_EQ(reader.frameCount(), 4);
  for (int k = 0; k < 4; ++k) {
    const FrameAndTruth read = reader.read(k);
    EXPECT_TRUE(read.frame.rgb.empty());
    EXPECT_EQ(read.frame.gray(3, 3), 77) << k;
    EXPECT_EQ(reader.frameNumber(k), k);
  }
  EXPECT_FALSE(reader.objects()[0].initial_T_camera_object.has_value());
}

TEST_F(Sequence, MissingAndBrokenImagesAreOneLine) {
  write("seq");
  const fs::path image = folder_ / "seq/rgb/000003.png";
  const std::string good = readFile(image);
  const auto read = [&] { SequenceReader(folder_ / "seq").read(3); };
  std::string flipped = good;
  flipped[good.size() / 2] = static_cast<char>(flipped[good.size() / 2] ^ 0x40);
  for (const std::string& bad :
       {std::string(), good.substr(0, good.size() / 2), flipped, good.substr(0, 40),
        std::string("not an image"), std::string("\xff\xd8\xff\xe0 cut")}) {
    writeFileAtomically(image, bad);
    EXPECT_THAT(errorLine(read, kExitBadData), StartsWith(image.string() + ": "));
  }
  writeFileAtomically(image, encodedOfSize(32, 48));
  EXPECT_THAT(errorLine(read, kExitBadData), HasSubstr("32x48 pixels, the camera 64x48"));
  fs::remove(image);
  EXPECT_THAT(errorLine(read, kExitMissingInput), StartsWith(image.string()));
  EXPECT_EQ(SequenceReader(folder_ / "seq").read(2).frame.index, 2);
}

TEST_F(Sequence, MissingAndMalformedFilesNameThePlace) {
  write("seq");
  const fs::path seq = folder_ / "seq";
  const auto open = [&] { SequenceReader reader(seq); };
  const std::vector<std::pair<std::string, std::string>> bad = {
      {"rgb.txt", "# only\n"},
      {"rgb.txt", "0.0 rgb/000000.png\nhello\n"},
      {"rgb.txt", "x rgb/000000.png\n"},
      {"rgb.txt", "0.1 rgb/000000.png\n0.1 rgb/000001.png\n"},
      {"groundtruth.txt", "0.0 1 2 3\n"},
      {"groundtruth.txt", "0.0 1 2 nan 0 0 0 1\n"},
      {"objects/box.txt", "0.0 1 2 3 0 0 0 0\n"},
      {"visibility.csv", "frame,object\n0,box\n"},
      {"visibility.csv", "h\n0,box,1,-2,3,0.5\n"},
      {"sequence.yaml", "images: rgb.txt\n"},
      {"sequence.yaml", "camera: [1]\nimages: rgb.txt\n"}};
  for (const auto& [name, content] : bad) {
    const std::string good = readFile(seq / name);
    writeFileAtomically(seq / name, content);
    EXPECT_THAT(errorLine(open, kExitBadData), StartsWith((seq / name).string())) << content;
    writeFileAtomically(seq / name, good);
  }
  for (const char* name : {"odometry.csv", "rgb.txt", "models/box/box.obj", "sequence.yaml"}) {
    fs::rename(seq / name, folder_ / "away");
    errorLine(open, kExitMissingInput);
    fs::rename(folder_ / "away", seq / name);
  }
  EXPECT_NO_THROW(open());
}

TEST_F(Sequence, AnOutputThatCannotBeWrittenIsAnOutputError) {
  writeFileAtomically(folder_ / "file", "");
  errorLine([&] { SequenceWriter(folder_ / "file/seq", scene_); }, kExitOutput);
  SequenceWriter writer(folder_ / "seq", scene_);
  fs::remove_all(folder_ / "seq/depth");
  const FrameAndTruth made = makeFrame(scene_, 0);
  errorLine([&] { writer.write(made.frame, *made.truth); }, kExitOutput);
  EXPECT_FALSE(writer.has(0));
}

TEST_F(Sequence, WritingAFrameTakesAtMostTwentyFiveMilliseconds) {
  scene_.camera.width = 640;
  scene_.camera.height = 480;
  SequenceWriter writer(folder_ / "large", scene_);
  const FrameAndTruth made = makeFrame(scene_, 0);
  double best_ms = 1e9;
  for (int i = 0; i < 8; ++i) {
    timespec begin{}, end{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &begin);
    writer.write(made.frame, *made.truth);
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &end);
    best_ms = std::min(best_ms, static_cast<double>(end.tv_sec - begin.tv_sec) * 1e3 +
                                    static_cast<double>(end.tv_nsec - begin.tv_nsec) * 1e-6);
  }
  std::printf("writing a frame: %.1f ms of one core\n", best_ms);
#if defined(NDEBUG) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
  EXPECT_LE(best_ms, 25);
#endif
}

}  // namespace
}  // namespace diorama
