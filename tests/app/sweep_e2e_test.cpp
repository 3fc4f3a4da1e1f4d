// A sweep as a user runs it: cells that end in all ways, stopped and gone on with, in shards.
#include <gmock/gmock.h>

#include <chrono>
#include <thread>

#include "core/files.h"
#include "eval/csv.h"
#include "tests/support/program.h"

namespace diorama {
namespace {

namespace fs = std::filesystem;

constexpr const char* kScene = R"(
camera: {width: 160, height: 120, fx: 131, fy: 131, cx: 79.5, cy: 59.5, rate_hz: 30}
duration_s: 1
environment: none
objects: [{name: box, model: tea_box, T_world_object: {position: [0, 0, 0]}, track: true}]
lights: [{type: area, center: [0, -1, 2], half_u: [0.5, 0, 0], half_v: [0, -0.5, 0], radiance: [8, 8, 8]}]
path:
  type: spline
  keyframes:
    - {t: -1, position: [-0.1, -0.5, 0.2], look_at: [0, 0, 0.05]}
    - {t: 0, position: [0, -0.5, 0.2], look_at: [0, 0, 0.05]}
    - {t: 1, position: [0.1, -0.5, 0.2], look_at: [0, 0, 0.05]}
    - {t: 2, position: [0.2, -0.5, 0.2], look_at: [0, 0, 0.05]}
odometry: {drift_m_per_m: 0.01}
)";

constexpr const char* kSpec = R"(
scene: scene.yaml
frames: 0:5
quality: draft
seeds: [1, 2]
factors:
  - {name: samples, path: tracker.max_samples, values: [100, nonsense]}
  - {name: method, values: [ebt, fused]}
)";

class SweepEndToEnd : public testing::Test {
 protected:
  void SetUp() override {
    folder_.write("scene.yaml", kScene);
    folder_.write("spec.yaml", kSpec);
  }
  test::ProgramResult sweep(const std::string& output, std::vector<std::string> more = {}) {
    std::vector<std::string> words = {"sweep", folder_ / "spec.yaml", "-o", folder_ / output};
    words.insert(words.end(), more.begin(), more.end());
    return test::runDiorama(words, folder_);
  }
  std::string results(const std::string& output) {
    return readFile(folder_ / output / "results.csv");
  }
  test::TemporaryFolder folder_;
};

TEST_F(SweepEndToEnd, EveryCellIsARowWhateverBecomesOfIt) {
  const test::ProgramResult result = sweep("whole", {"-j", "2"});
  ASSERT_EQ(result.code, 0) << result.err;
  const CsvTable table = parseCsv(results("whole"));
  ASSERT_EQ(table.rows.size(), 8u);
  for (size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(table.rows[i][table.column("status").value()], i < 4 ? "done" : "failed") << i;
    EXPECT_EQ(table.rows[i][table.column("code").value()], i < 4 ? "0" : "65") << i;
  }
  for (const char* file : {"timings.csv", "sweep.sqlite", "report.html"})
    EXPECT_TRUE(fs::exists(folder_ / "whole" / file)) << file;
  EXPECT_FALSE(fs::exists(folder_ / "whole/pictures"));

  EXPECT_EQ(sweep("part0", {"--shard", "0/2"}).code, 0);
  EXPECT_EQ(sweep("part1", {"--shard", "1/2"}).code, 0);
  const std::vector<std::string> parts = {"--merge", folder_ / "part0", "--merge",
                                          folder_ / "part1"};
  EXPECT_EQ(sweep("merged", parts).code, 0);
  EXPECT_EQ(results("merged"), results("whole"));

  fs::remove_all(folder_ / "whole/cells" /
                 fs::directory_iterator(folder_ / "whole/cells")->path().filename());
  const std::string before = results("whole");
  EXPECT_EQ(sweep("whole").code, 74);
  EXPECT_EQ(sweep("whole", {"--resume"}).code, 0);
  EXPECT_EQ(results("whole"), before);
}

TEST_F(SweepEndToEnd, MissedThresholdsAndWrongSpecsHaveTheirExitCodes) {
  folder_.write("spec.yaml", std::string(kSpec) +
                                 "thresholds: [{metric: success_5cm_5deg, at_least: 1.5, where: "
                                 "{samples: 100}}]\n");
  const test::ProgramResult missed = sweep("missed");
  EXPECT_EQ(missed.code, 1);
  EXPECT_THAT(missed.out, testing::HasSubstr("missed: success_5cm_5deg >= 1.5"));
  EXPECT_EQ(sweep("missed", {"--shard", "2/2"}).code, 2);
  folder_.write("spec.yaml", "factors: 3\n");
  EXPECT_EQ(sweep("wrong").code, 65);
  fs::remove(folder_ / "spec.yaml");
  EXPECT_EQ(sweep("none").code, 66);
}

}  // namespace
}  // namespace diorama
