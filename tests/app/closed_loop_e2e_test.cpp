// Short closed loops against accuracy bands, and what users rely on around them.
#include <gtest/gtest.h>

#include "app/metrics_json.h"
#include "core/errors.h"
#include "core/files.h"
#include "core/trajectory.h"
#include "tests/support/program.h"

namespace diorama {
namespace {

namespace fs = std::filesystem;
using test::ProgramResult;
using test::runDiorama;

constexpr const char* kScene = "scenes/orange_juice.yaml";

ProgramResult run(const test::TemporaryFolder& folder, const std::string& input,
                  const std::string& output, std::vector<std::string> more = {}) {
  std::vector<std::string> arguments = {"run", input, "-o", (folder / output).string(),
                                        "--no-video"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return runDiorama(arguments, folder);
}

void renderDraft(const test::TemporaryFolder& folder, const std::string& output,
                 const std::string& frames) {
  const ProgramResult result = runDiorama({"render", kScene, "-o", (folder / output).string(),
                                           "--frames", frames, "--quality", "draft"},
                                          folder);
  ASSERT_EQ(result.code, 0) << result.err;
}

std::string estimates(const fs::path& run_folder) {
  std::string all;
  for (const char* name :
       {"camera_online.txt", "camera.txt", "map.json", "objects/orange_juice.txt"})
    all += readFile(run_folder / name);
  return all;
}

TEST(ClosedLoop, FusedOnOrangeJuice) {
  const test::TemporaryFolder folder;
  const ProgramResult result = runDiorama(
      {"run", kScene, "-o", (folder / "run").string(), "--odometry", "simulated", "--frames",
       "0:120", "--expect", "success_5cm_5deg>=0.99", "--expect", "mean_error_m<=0.004", "--expect",
       "ate_mean_m<=0.010", "--expect", "false_claim_ratio==0"},
      folder);
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_NE(result.out.find("orange_juice"), std::string::npos);
  EXPECT_GT(fs::file_size(folder / "run/overlay.mp4"), 10000u);
  const Metrics metrics = metricsFromJson(folder / "run/metrics.json");
  EXPECT_EQ(metrics.frames, 120);
  EXPECT_EQ(readTum(folder / "run/camera_online.txt").poses.size(), 120u);
  EXPECT_EQ(readTum(folder / "run/objects/orange_juice.txt").poses.size(), 120u);
}

TEST(ClosedLoop, TrackerAloneOnOrangeJuice) {
  const test::TemporaryFolder folder;
  const ProgramResult result =
      run(folder, kScene, "run",
          {"--method", "ebt", "--frames", "0:120", "--expect", "claimed_ratio>=0.99", "--expect",
           "mean_error_m<=0.004", "--expect", "false_claim_ratio==0"});
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_FALSE(metricsFromJson(folder / "run/metrics.json").camera.ate_mean_m.has_value());
}

TEST(ClosedLoop, ASceneIsItsSequenceAndTruthDoesNotMatter) {
  const test::TemporaryFolder folder;
  renderDraft(folder, "seq", "0:25");
  const std::vector<std::string> range = {"--frames", "0:25", "--quality", "draft"};
  ASSERT_EQ(run(folder, kScene, "from_scene", range).code, 0);
  ASSERT_EQ(run(folder, (folder / "seq").string(), "from_sequence").code, 0);
  const std::string expected = estimates(folder / "from_scene");
  EXPECT_EQ(estimates(folder / "from_sequence"), expected);

  fs::copy(folder / "seq", folder / "false", fs::copy_options::recursive);
  for (const char* file : {"groundtruth.txt", "objects/orange_juice.txt"}) {
    std::string lies;
    for (const StampedPose& pose : readTum(folder / "false" / file).poses)
      lies += toTum({{{pose.timestamp_ns, SE3{Eigen::Quaterniond(0, 1, 0, 0), {3, 4, 5}}}}});
    writeFileAtomically(folder / "false" / file, lies);
  }
  ASSERT_EQ(run(folder, (folder / "false").string(), "from_false").code, 0);
  EXPECT_EQ(estimates(folder / "from_false"), expected);
  EXPECT_GT(*metricsFromJson(folder / "from_false/metrics.json").objects[0].metrics.map_error_m,
            0.5);

  fs::rename(folder / "false", folder / "bare");
  for (const char* name : {"groundtruth.txt", "objects", "depth.txt", "depth", "visibility.csv",
                           "mask", "mask_visib", "id", "instances.csv", "manifest.csv"})
    fs::remove_all(folder / "bare" / name);
  ASSERT_EQ(run(folder, (folder / "bare").string(), "from_bare").code, 0);
  EXPECT_EQ(estimates(folder / "from_bare"), expected);
  EXPECT_FALSE(metricsFromJson(folder / "from_bare/metrics.json").camera.ate_mean_m.has_value());
}

TEST(ClosedLoop, ADiskThatIsFullLeavesNothing) {
  const test::TemporaryFolder folder;
  renderDraft(folder, "seq", "0:10");
  for (const char* blocks : {"8", "12", "24"}) {
    const std::string command = std::string("ulimit -f ") + blocks + "; " +
                                test::shellQuoted(DIORAMA_BINARY) +
                                " run seq -o run --method ebt --no-video";
    const ProgramResult result = test::runShell(command, folder.path(), folder);
    EXPECT_EQ(result.code, kExitOutput) << result.err;
    EXPECT_FALSE(fs::exists(folder / "run")) << blocks;
  }
}

TEST(ClosedLoop, ReusesACompleteRunAndRefusesOthers) {
  const test::TemporaryFolder folder;
  renderDraft(folder, "seq", "0:3");
  const std::string sequence = (folder / "seq").string();
  const ProgramResult first = run(folder, sequence, "run");
  ASSERT_EQ(first.code, 0) << first.err;
  const auto written = fs::last_write_time(folder / "run/metrics.json");
  const ProgramResult again = run(folder, sequence, "run");
  EXPECT_EQ(again.code, 0);
  EXPECT_EQ(again.out, first.out);
  EXPECT_EQ(fs::last_write_time(folder / "run/metrics.json"), written);
  EXPECT_EQ(run(folder, sequence, "run", {"--expect", "reported_ratio>1"}).code, kExitMissed);
  EXPECT_EQ(run(folder, sequence, "run", {"--method", "ebt"}).code, kExitOutput);
  fs::remove(folder / "run/metrics.json");
  EXPECT_EQ(run(folder, sequence, "run").code, kExitOutput);
}

TEST(ClosedLoop, BrokenAndMissingImagesAreOneLine) {
  const test::TemporaryFolder folder;
  renderDraft(folder, "seq", "0:4");
  const std::string png = readFile(folder / "seq/rgb/000002.png");
  writeFileAtomically(folder / "seq/rgb/000002.png", png.substr(0, png.size() / 3));
  ProgramResult result = run(folder, (folder / "seq").string(), "run");
  EXPECT_EQ(result.code, kExitBadData);
  EXPECT_NE(result.err.find("000002.png"), std::string::npos) << result.err;
  EXPECT_FALSE(fs::exists(folder / "run/metrics.json"));
  fs::remove(folder / "seq/rgb/000002.png");
  result = run(folder, (folder / "seq").string(), "run2");
  EXPECT_EQ(result.code, kExitMissingInput);
  EXPECT_NE(result.err.find("000002.png"), std::string::npos) << result.err;
}

TEST(ClosedLoop, OdometryDriftAloneIsWorseThanFused) {
  const test::TemporaryFolder folder;
  renderDraft(folder, "seq", "0:90");
  const std::string sequence = (folder / "seq").string();
  ASSERT_EQ(run(folder, sequence, "vo", {"--method", "vo", "--odometry", "simulated"}).code, 0);
  ASSERT_EQ(run(folder, sequence, "fused", {"--odometry", "simulated"}).code, 0);
  const Metrics vo = metricsFromJson(folder / "vo/metrics.json"),
                fused = metricsFromJson(folder / "fused/metrics.json");
  EXPECT_LT(*fused.objects[0].metrics.mean_error_m, *vo.objects[0].metrics.mean_error_m);
  EXPECT_LT(*fused.camera.ate_mean_m, *vo.camera.ate_mean_m);
}

TEST(RealVideo, TheCubeIsTrackedToTheLastFrame) {
  const test::TemporaryFolder folder;
  const ProgramResult imported =
      test::runShell("scripts/import-visp-cube " + test::shellQuoted((folder / "cube").string()),
                     DIORAMA_SOURCE_DIR, folder);
  if (imported.code == kExitMissingInput) GTEST_SKIP() << imported.err;
  ASSERT_EQ(imported.code, 0) << imported.err;
  const ProgramResult result = run(folder, (folder / "cube").string(), "run",
                                   {"--method", "ebt", "--expect", "claimed_ratio>=1"});
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_EQ(readTum(folder / "run/objects/cube.txt").poses.size(), 218u);
}

}  // namespace
}  // namespace diorama
