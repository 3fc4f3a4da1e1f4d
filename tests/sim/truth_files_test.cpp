#include "sim/truth_files.h"

#include <gmock/gmock.h>

#include <opencv2/imgcodecs.hpp>

#include "core/sha256.h"
#include "core/text.h"
#include "sim/sequence_writer.h"
#include "sim/simulator.h"
#include "tests/sim/scene_support.h"

namespace diorama {
namespace {

namespace fs = std::filesystem;
using test::object;
using test::plainScene;
using test::square;
using test::Workshop;
using ::testing::HasSubstr;

Scene filmedScene(const Workshop& workshop) {
  Scene scene = plainScene();
  scene.duration_s = 0.1;
  scene.path =
      makeSplinePath({{-1, lookAt({0, 1, 0}, {1, 0, 0})}, {1, lookAt({0, -1, 0}, {1, 0, 0})}});
  scene.objects = {object("a", workshop.write("a.obj", square(0.5)), Vector3d(1, 0, 0))};
  return scene;
}

fs::path film(const Workshop& workshop, const Scene& scene, const std::string& name, int first,
              int end, TruthChannels truth) {
  Simulator simulator(scene, {RenderQuality::kDraft, 1, truth});
  SequenceWriter writer(workshop.folder() / name, scene, {first, end});
  for (int k = first; k < end; ++k) {
    const FrameAndTruth next = simulator.read(k);
    writer.write(next.frame, *next.truth);
    EXPECT_TRUE(writer.has(k));
  }
  writer.finish();
  return workshop.folder() / name;
}

std::vector<std::string> lines(const std::string& text) {
  std::vector<std::string> result;
  for (const std::string_view line : split(text, '\n')) result.emplace_back(line);
  return result;
}

TEST(TruthFiles, FlowAndNormalsReadBack) {
  const Workshop workshop("truth_files");
  const Scene scene = filmedScene(workshop);
  const fs::path folder = film(workshop, scene, "seq", 0, 2, {.normal = true, .flow = true});
  const GroundTruth truth =
      *Simulator(scene, {RenderQuality::kDraft, 1, {.normal = true, .flow = true}}).read(0).truth;
  const cv::Mat flow = cv::imread(folder / "flow/000000_000001.png", cv::IMREAD_UNCHANGED);
  const cv::Mat state = cv::imread(folder / "flow/000000_000001_state.png", cv::IMREAD_UNCHANGED);
  const cv::Mat normal = cv::imread(folder / "normal/000000.png", cv::IMREAD_UNCHANGED);
  ASSERT_EQ(flow.type(), CV_16UC3);
  ASSERT_EQ(state.type(), CV_8U);
  ASSERT_EQ(normal.type(), CV_8UC3);
  int seen = 0;
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x) {
      const cv::Vec3w f = flow.at<cv::Vec3w>(y, x);  // blue, green, red
      ASSERT_EQ(state.at<uint8_t>(y, x), static_cast<uint8_t>(truth.flow->state(x, y)));
      ASSERT_EQ(f[0], state.at<uint8_t>(y, x) == 0);
      const cv::Vec3b n = normal.at<cv::Vec3b>(y, x);
      if (truth.instance_id(x, y) == 0) {
        ASSERT_EQ(n, cv::Vec3b());
        ASSERT_EQ(f, cv::Vec3w());
        continue;
      }
      ASSERT_NEAR((f[2] - 32768) / 64.0, static_cast<double>(truth.flow->flow_px(x, y).u),
                  1.0 / 128 + 1e-4);
      ASSERT_NEAR((f[1] - 32768) / 64.0, static_cast<double>(truth.flow->flow_px(x, y).v),
                  1.0 / 128 + 1e-4);
      ASSERT_NEAR(n[2] / 127.5 - 1, static_cast<double>(truth.normal(x, y).x), 0.004);
      ASSERT_NEAR(n[0] / 127.5 - 1, static_cast<double>(truth.normal(x, y).z), 0.004);
      ++seen;
    }
  EXPECT_GT(seen, 2000);
  // Frame 2 is not part of the sequence, nor is flow to it; no leftovers.
  EXPECT_FALSE(fs::exists(folder / "flow/000001_000002.png"));
  EXPECT_FALSE(fs::exists(folder / "partial"));
  EXPECT_FALSE(fs::exists(folder / "row_poses.csv"));
  EXPECT_THAT(
      readFile(folder / "manifest.csv"),
      HasSubstr("flow/000000_000001.png," + sha256(readFile(folder / "flow/000000_000001.png"))));
}

TEST(TruthFiles, FlowBeyondTheFormatIsLeftOut) {
  FlowField field;
  field.flow_px = Image<FlowVector>(3, 1);
  field.state = Image<FlowState>(3, 1, FlowState::kVisible);
  field.flow_px(0, 0) = {511.5f, -511.5f};
  field.flow_px(1, 0) = {513, 0};
  field.flow_px(2, 0) = {1, 0};
  field.state(2, 0) = FlowState::kHiddenBySelf;
  const Image<Rgb16> picture = toPicture(field);
  EXPECT_EQ(picture(0, 0), (Rgb16{65504, 32, 1}));
  EXPECT_EQ(picture(1, 0), (Rgb16{}));
  EXPECT_EQ(picture(2, 0), (Rgb16{32832, 32768, 0}));
}

TEST(TruthFiles, EdgesOfAllFrames) {
  const Workshop workshop("edge_files");
  const fs::path folder = film(workshop, filmedScene(workshop), "seq", 0, 2, {.edges = true});
  const std::vector<std::string> rows = lines(readFile(folder / "edges.csv"));
  EXPECT_EQ(rows[0], "frame,object,edge_id,kind,part,u,v");
  EXPECT_TRUE(rows[1].starts_with("0,a,0,boundary,0,")) << rows[1];
  EXPECT_TRUE(rows[rows.size() - 2].starts_with("1,a,3,boundary,3,")) << rows[rows.size() - 2];
  EXPECT_GT(rows.size(), 100u);
}

TEST(TruthFiles, RowPosesAndExposures) {
  const Workshop workshop("row_files");
  Scene scene = filmedScene(workshop);
  scene.row_time_s = 1e-4;
  scene.exposure_s = 0.01;
  const fs::path folder = film(workshop, scene, "seq", 1, 3, {});
  const std::vector<std::string> rows = lines(readFile(folder / "row_poses.csv"));
  ASSERT_EQ(rows.size(), 1u + 2 * 120 + 1);
  EXPECT_EQ(rows[0], "frame,row,timestamp,tx,ty,tz,qx,qy,qz,qw");
  EXPECT_EQ(rows[1], "1,0,0.027383000," + formatPose(scene.path->pose(0.033333 - 59.5e-4), ','));
  EXPECT_EQ(rows[240].substr(0, 18), "2,119,0.072617000,");
  const std::vector<std::string> exposures = lines(readFile(folder / "exposures.csv"));
  EXPECT_EQ(exposures[0], "frame,open,mid,close");
  EXPECT_EQ(exposures[2], "2,0.061667,0.066667,0.071667");
  const std::string manifest = readFile(folder / "manifest.csv");
  EXPECT_THAT(manifest, HasSubstr("row_poses.csv," + sha256(readFile(folder / "row_poses.csv"))));
  EXPECT_THAT(manifest, testing::Not(HasSubstr("partial")));
  // The same rows when frame 2 is rendered alone.
  const fs::path alone = film(workshop, scene, "alone", 2, 3, {});
  EXPECT_EQ(lines(readFile(alone / "row_poses.csv"))[1], rows[121]);
}

}  // namespace
}  // namespace diorama
