#include "sim/sequence_check.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <numbers>

#include "core/errors.h"
#include "core/text.h"
#include "core/trajectory.h"
#include "mutator.h"
#include "sim/image_file.h"
#include "sim/png_encoder.h"
#include "sim/sequence_writer.h"
#include "sim/simulator.h"
#include "tests/sim/scene_support.h"

namespace diorama {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

// Eight corners around the origin; `inside` turns the faces, for a room.
std::string box(double x, double y, double z, bool inside = false) {
  std::string text;
  for (int i = 0; i < 8; ++i)
    text += "v " + formatNumber((i & 1 ? x : -x) / 2) + " " + formatNumber((i & 2 ? y : -y) / 2) +
            " " + formatNumber((i & 4 ? z : -z) / 2) + "\n";
  for (const auto& f : {"1342", "5687", "1265", "3784", "1573", "2486"}) {
    std::string corners(f);
    if (inside) std::reverse(corners.begin(), corners.end());
    text += "f";
    for (char c : corners) text += " " + std::string(1, c);
    text += "\n";
  }
  return text;
}

// A camera that passes a known box, half hidden behind an unknown one, in a room.
Scene scene(const test::Workshop& workshop) {
  Scene scene = test::plainScene();
  scene.camera = {CameraModel::kRadTan, 160, 120, 130, 131, 80, 59, {-0.1, 0.02, 0.001, 0}};
  scene.path = makeSplinePath({{0, lookAt(Vector3d(-0.8, -0.3, 0.4), Vector3d(0, 0, 0))},
                               {0.2, lookAt(Vector3d(-0.75, -0.2, 0.35), Vector3d(0, 0.05, 0))},
                               {0.4, lookAt(Vector3d(-0.8, -0.1, 0.3), Vector3d(0.05, 0, 0))}});
  scene.rate_hz = 20;
  scene.duration_s = 0.4;
  scene.ambient = 0.5;
  scene.objects = {
      test::object("known", workshop.write("known.obj", box(0.2, 0.25, 0.3)), Vector3d(0, 0, 0)),
      test::object("other", workshop.write("other.obj", box(0.1, 0.1, 0.2)),
                   Vector3d(-0.2, 0.05, -0.05), false),
      test::object("room", workshop.write("room.obj", box(4, 3, 2, true)), Vector3d(0.5, 0, 0.85),
                   false)};
  scene.objects[0].T_world_object.rotation = expSO3({0, 0, 0.4});
  return scene;
}

// Rendered once; each test spoils a copy.
class SequenceCheckTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    workshop_ = new test::Workshop("check");
    const Scene filmed = scene(*workshop_);
    Simulator simulator(filmed, {RenderQuality::kDraft, 1, {.normal = true, .flow = true}});
    SequenceWriter writer(workshop_->folder() / "good", filmed);
    for (int k = 0; k < simulator.frameCount(); ++k) {
      const FrameAndTruth frame = simulator.read(k);
      writer.write(frame.frame, *frame.truth);
    }
    writer.finish();
  }
  static void TearDownTestSuite() { delete workshop_; }

  void SetUp() override {
    sequence_ = workshop_->folder() / "copy";
    fs::remove_all(sequence_);
    fs::copy(workshop_->folder() / "good", sequence_, fs::copy_options::recursive);
  }

  std::vector<CheckFinding> findings() const {
    const SequenceCheck check(sequence_);
    CheckResult all = check.checkWhole();
    for (int part = 0; part < check.partCount(); ++part) all.append(check.checkPart(part));
    return all.findings;
  }
  std::vector<CheckFinding> findingsWithoutManifest() const {
    fs::remove(sequence_ / "manifest.csv");
    return findings();
  }

  std::string text(const std::string& file) const { return readFile(sequence_ / file); }
  void rewrite(const std::string& file, const std::string& content) const {
    writeFileAtomically(sequence_ / file, content);
  }
  void replace(const std::string& file, const std::string& from, const std::string& to) const {
    std::string content = text(file);
    const size_t at = content.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    rewrite(file, content.replace(at, from.size(), to));
  }

  template <class T>
  Image<T> image(const std::string& file) const {
    return std::get<Image<T>>(readImage(sequence_ / file, 160, 120));
  }
  void changeDepth(const std::string& file, int x, int y, int units) const {
    Image<uint16_t> depth = image<uint16_t>(file);
    depth(x, y) = static_cast<uint16_t>(depth(x, y) + units);
    rewrite(file, encodePng(depth));
  }
  // T * Exp(xi) in one line of a trajectory.
  void movePose(const std::string& file, size_t line, const Vector6d& xi) const {
    Trajectory path = readTum(sequence_ / file);
    path.poses[line].pose = path.poses[line].pose * exp(xi);
    rewrite(file, toTum(path));
  }

  static test::Workshop* workshop_;
  fs::path sequence_;
};
test::Workshop* SequenceCheckTest::workshop_ = nullptr;

std::string listed(const std::vector<CheckFinding>& findings) {
  std::string all;
  for (const CheckFinding& f : findings) all += f.file + ": " + f.what + "\n";
  return all;
}

TEST_F(SequenceCheckTest, AGoodSequenceHasNoFindings) {
  const auto found = findings();
  EXPECT_THAT(found, IsEmpty()) << listed(found);
  const SequenceCheck check(sequence_);
  EXPECT_EQ(check.partCount(), 8);
  const CheckResult part = check.checkPart(3);
  for (const Check c :
       {Check::kFiles, Check::kImages, Check::kMasks, Check::kVisibility, Check::kObjects,
        Check::kDepth, Check::kPoses, Check::kFlow, Check::kNormals})
    EXPECT_GT(part.examined[static_cast<size_t>(c)], 0) << static_cast<int>(c);
}

TEST_F(SequenceCheckTest, AnyChangedByteIsNoticedByItsSum) {
  changeDepth("depth/000003.png", 20, 20, 1);
  replace("objects/known.txt", "0.050000 ", "0.050001 ");
  fs::remove(sequence_ / "id/000004.png");
  const auto found = findings();
  for (const char* file : {"depth/000003.png", "objects/known.txt", "id/000004.png"})
    EXPECT_THAT(found, Contains(Field(&CheckFinding::file, file))) << listed(found);
}

// Every place that has a surface: walls, floor, the other box and the known one.
TEST_F(SequenceCheckTest, OnePixelOfDepthThatIsTwentyMillimetresOff) {
  const std::string file = "depth/000004.png", good = text(file);
  const Image<uint16_t> ids = image<uint16_t>("id/000004.png");
  fs::remove(sequence_ / "manifest.csv");
  int tried = 0, found = 0;
  for (int y = 7; y < 120; y += 35)
    for (int x = 9; x < 160; x += 29) {
      rewrite(file, good);
      changeDepth(file, x, y, tried % 2 ? 100 : -100);
      ++tried;
      const SequenceCheck check(sequence_);
      const std::vector<CheckFinding> findings = check.checkPart(4).findings;
      found += std::any_of(findings.begin(), findings.end(), [&](const CheckFinding& f) {
        return f.file == file && f.what.find("(" + std::to_string(x) + ", " + std::to_string(y) +
                                             ")") != std::string::npos;
      });
    }
  EXPECT_EQ(tried, 24);
  EXPECT_GE(found, 23);
}

TEST_F(SequenceCheckTest, APoseOfTheCameraThatIsFiveMillimetresOrHalfADegreeOff) {
  fs::remove(sequence_ / "manifest.csv");
  fs::remove(sequence_ / "odometry.csv");  // its noise alone would tell
  replace("sequence.yaml", "odometry: odometry.csv\n", "");
  const std::string good = text("groundtruth.txt");
  for (size_t line : {0u, 4u, 7u})
    for (int axis = 0; axis < 6; ++axis) {
      rewrite("groundtruth.txt", good);
      movePose("groundtruth.txt", line,
               Vector6d::Unit(axis) * (axis < 3 ? 0.005 : 0.5 * std::numbers::pi / 180));
      const auto found = findings();
      EXPECT_THAT(found, Contains(Field(&CheckFinding::file, "groundtruth.txt")))
          << line << " " << axis;
      EXPECT_THAT(found, Not(Contains(Field(&CheckFinding::file, HasSubstr("objects/")))));
    }
}

TEST_F(SequenceCheckTest, APoseOfAnObjectThatIsFiveMillimetresOrHalfADegreeOff) {
  fs::remove(sequence_ / "manifest.csv");
  const std::string good = text("objects/known.txt");
  for (int axis = 0; axis < 6; ++axis) {
    rewrite("objects/known.txt", good);
    movePose("objects/known.txt", 2,
             Vector6d::Unit(axis) * (axis < 3 ? 0.005 : 0.5 * std::numbers::pi / 180));
    const SequenceCheck check(sequence_);
    const auto found = check.checkPart(2).findings;
    ASSERT_FALSE(found.empty()) << axis;
    for (const CheckFinding& f : found) EXPECT_EQ(f.file, "objects/known.txt") << f.what;
    EXPECT_THAT(check.checkPart(3).findings, IsEmpty());
    EXPECT_THAT(check.checkWhole().findings,
                Contains(Field(&CheckFinding::what, HasSubstr("rest"))));
  }
}

TEST_F(SequenceCheckTest, MasksMustBeThoseOfTheIdsAndOfTheMesh) {
  Image<uint8_t> visible = image<uint8_t>("mask_visib/000001_000000.png");
  const auto shown = std::find(visible.pixels.begin(), visible.pixels.end(), 255);
  *shown = 0;
  rewrite("mask_visib/000001_000000.png", encodePng(visible, PngContent::kLabels));
  Image<uint8_t> whole = image<uint8_t>("mask/000002_000000.png");
  whole(3, 4) = 255;
  rewrite("mask/000002_000000.png", encodePng(whole, PngContent::kLabels));
  whole(3, 4) = 7;
  rewrite("mask/000003_000000.png", encodePng(whole, PngContent::kLabels));
  Image<uint16_t> ids = image<uint16_t>("id/000005.png");
  ids(0, 0) = 9;
  rewrite("id/000005.png", encodePng(ids));
  const auto found = findingsWithoutManifest();
  EXPECT_THAT(listed(found), HasSubstr("mask_visib/000001_000000.png: is not what the ids say"));
  EXPECT_THAT(listed(found), HasSubstr("mask_visib/000001_000000.png: has "));
  EXPECT_THAT(listed(found), HasSubstr("mask/000002_000000.png: has "));
  EXPECT_THAT(
      listed(found),
      HasSubstr("mask/000002_000000.png: is not the silhouette of the mesh, at pixel (3, 4)"));
  EXPECT_THAT(listed(found), HasSubstr("mask/000003_000000.png: has the value 7"));
  EXPECT_THAT(listed(found), HasSubstr("id/000005.png: has an id that is not in instances.csv"));
}

TEST_F(SequenceCheckTest, FlowAndNormalsMustBeThoseOfDepthAndPoses) {
  Image<Rgb16> flow = readWideColor(sequence_ / "flow/000002_000003.png", 160, 120);
  ASSERT_EQ(flow(80, 100).b, 1);
  flow(80, 100).r = static_cast<uint16_t>(flow(80, 100).r + 5);  // 0.08 px
  rewrite("flow/000002_000003.png", encodePng(flow));
  Image<Rgb8> normal = image<Rgb8>("normal/000004.png");
  for (int x = 0; x < 160; ++x) std::swap(normal(x, 100).r, normal(x, 100).g);
  rewrite("normal/000004.png", encodePng(normal));
  const auto found = findingsWithoutManifest();
  EXPECT_THAT(listed(found), HasSubstr("flow/000002_000003.png: is not what depth and poses make "
                                       "of it at pixel (80, 100) and at 0 more"));
  EXPECT_THAT(listed(found), HasSubstr("normal/000004.png: is "));
  for (const CheckFinding& f : found)
    EXPECT_TRUE(f.check == Check::kFlow || f.check == Check::kNormals) << listed(found);
}

TEST_F(SequenceCheckTest, TimesMustAgree) {
  const std::vector<std::pair<std::string, std::string>> lines = {
      {"rgb.txt", "0.100000 "},
      {"depth.txt", "0.150000 "},
      {"groundtruth.txt", "0.200000 "},
      {"objects/known.txt", "0.250000 "}};
  for (const auto& [file, time] : lines) {
    SetUp();
    replace(file, "\n" + time, "\n" + std::string(time).replace(4, 1, "1"));
    const auto found = findingsWithoutManifest();
    ASSERT_FALSE(found.empty()) << file;
    EXPECT_THAT(found, Contains(Field(&CheckFinding::file, file))) << listed(found);
  }
}

TEST_F(SequenceCheckTest, VisibilityMustBeThatOfThePixels) {
  const std::string rows = text("visibility.csv");
  const size_t row = rows.find("\n4,known,") + 1, end = rows.find('\n', row);
  rewrite("visibility.csv", std::string(rows).erase(row, end - row + 1));
  EXPECT_THAT(listed(findingsWithoutManifest()),
              HasSubstr("visibility.csv: has no row for known in frame 4"));
  rewrite("visibility.csv", std::string(rows).insert(rows.rfind(',', end) + 1, "1"));
  EXPECT_THAT(listed(findingsWithoutManifest()),
              HasSubstr("the fraction is not that of the counts"));
}

TEST_F(SequenceCheckTest, WhatCannotBeReadIsAFindingAboutItsFile) {
  rewrite("rgb/000002.png", text("rgb/000002.png").substr(0, 100));
  rewrite("depth/000003.png", text("depth/000003.png").substr(0, 100));
  rewrite("instances.csv", "id,name\nx,known\n");
  std::vector<CheckFinding> found = findingsWithoutManifest();
  EXPECT_THAT(listed(found), HasSubstr("rgb/000002.png: the image is cut short"));
  EXPECT_THAT(listed(found), HasSubstr("depth/000003.png: the image is cut short"));
  EXPECT_THAT(listed(found), HasSubstr("instances.csv: 2: the id is no number"));
  rewrite("groundtruth.txt", "0.0 1 2\n");
  found = findingsWithoutManifest();
  EXPECT_THAT(found, Contains(Field(&CheckFinding::file, "groundtruth.txt"))) << listed(found);
}

// Findings, or an error of one line where nothing can be said; never a crash.
TEST_F(SequenceCheckTest, MutatedFiles) {
  const std::vector<std::string> files = {"manifest.csv",      "visibility.csv", "instances.csv",
                                          "groundtruth.txt",   "depth.txt",      "rgb.txt",
                                          "objects/known.txt", "sequence.yaml",  "odometry.csv"};
  int noticed = 0;
  constexpr uint32_t kTries = 540;
  for (uint32_t seed = 0; seed < kTries; ++seed) {
    const std::string& file = files[seed % files.size()];
    const std::string good = text(file), damaged = testing::Mutator(5000 + seed).mutate(good);
    rewrite(file, damaged);
    testing::survives(
        [&] {
          const SequenceCheck check(sequence_);
          noticed += !check.checkWhole().findings.empty();
        },
        damaged);
    rewrite(file, good);
  }
  EXPECT_GT(noticed, 100);
}

TEST_F(SequenceCheckTest, ASequenceWithoutTruthIsNotBlamedForIt) {
  for (const char* name : {"groundtruth.txt", "depth.txt", "visibility.csv", "instances.csv",
                           "objects", "depth", "id", "mask", "mask_visib", "flow", "normal"})
    fs::remove_all(sequence_ / name);
  const auto found = findingsWithoutManifest();
  EXPECT_THAT(found, IsEmpty()) << listed(found);
  fs::remove(sequence_ / "sequence.yaml");
  EXPECT_THROW(SequenceCheck{sequence_}, MissingInputError);
}

}  // namespace
}  // namespace diorama
