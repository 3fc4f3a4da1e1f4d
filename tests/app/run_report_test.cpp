#include "app/run_report.h"

#include <gmock/gmock.h>

#include "app/option_list.h"
#include "core/errors.h"
#include "core/files.h"
#include "tests/support/temporary_folder.h"

namespace diorama {
namespace {

using testing::HasSubstr;

constexpr const char* kMetrics =
    R"({"scene": "s", "method": "fused", "initial": "given", "seed": 1, "frames": 2, "start_frame": 0,
        "camera": {}, "objects": {"box": {}}, "timing": {}, "peak_memory_mb": null})";

class RunReportTest : public testing::Test {
 protected:
  std::string page() {
    writeRunReport({folder_.path()}, folder_ / "report.html");
    return readFile(folder_ / "report.html");
  }
  test::TemporaryFolder folder_;
};

TEST_F(RunReportTest, WithoutMetricsThereIsNoRun) {
  EXPECT_FALSE(isRunFolder(folder_.path()));
  EXPECT_THROW(page(), MissingInputError);
  for (const char* bad :
       {"", "[]", "{}", "{\"objects\": 3}", R"({"objects": {}, "method": 5, "scene": []})"}) {
    folder_.write("metrics.json", bad);
    EXPECT_THROW(page(), InputError) << bad;
  }
}

TEST_F(RunReportTest, MetricsAloneGiveAPage) {
  folder_.write("metrics.json", kMetrics);
  EXPECT_THAT(page(), HasSubstr("\"frame\":[]"));
}

TEST_F(RunReportTest, PosesAreShownInTheTruesWorld) {
  folder_.write("metrics.json", kMetrics);
  folder_.write("timing.csv", "frame,timestamp\n0,0.0\n1,0.1\n");
  folder_.write("camera_online.txt", "0 0 0 0 0 0 0 1\n0.1 1 0 0 0 0 0 1\n");
  std::filesystem::create_directories(folder_ / "truth");
  folder_.write("truth/camera.txt", "0 5 0 0 0 0 0 1\n0.1 6 0.5 0 0 0 0 1\n");
  const std::string text = page();
  EXPECT_THAT(text, HasSubstr("\"world\":\"truth\""));
  EXPECT_THAT(text, HasSubstr("\"estimated\":[[5.0,0.0,0.0,0.0,0.0,0.0,1.0],[6.0,"));
  EXPECT_THAT(text, HasSubstr("\"error_m\":[0.0,0.5]"));
}

TEST_F(RunReportTest, TakesHostileTables) {
  folder_.write("metrics.json", kMetrics);
  folder_.write("timing.csv", "frame,timestamp\nx,y\n1\n,,,,,\n2,nan\n3,0.5\n");
  folder_.write("errors.csv", "frame,object,err_m\n3,box,nan\n3,other,1\n99,box,1\n3\n");
  folder_.write("frames.csv", "frame,timestamp,source,claimed,health,c00\n3,0.5,box,1,inf,1\n");
  folder_.write("events.csv", "timestamp,event\nsoon,lost\n0.5,<b>\n");
  folder_.write("points.csv", "x,y\n1\n");
  EXPECT_THAT(page(), HasSubstr("\"frame\":[3]"));
}

TEST(OptionList, MarksWhatIsNotUsual) {
  const auto list = optionList("seed: 3\ntracker: {max_samples: 7}\n");
  ASSERT_EQ(list.size(), 2u);
  EXPECT_TRUE(list[0][2].is_null());
  EXPECT_EQ(list[1][0], "tracker.max_samples");
  EXPECT_EQ(list[1][1], "7");
  EXPECT_NE(list[1][2], "7");
  EXPECT_TRUE(optionList("[: no yaml").empty());
}

}  // namespace
}  // namespace diorama
