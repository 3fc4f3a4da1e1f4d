// `train` and `--initial detect` as a user has them.
#include <gmock/gmock.h>

#include "app/metrics_json.h"
#include "core/errors.h"
#include "core/files.h"
#include "tests/support/program.h"

namespace diorama {
namespace {

using test::ProgramResult;
using test::runDiorama;
using ::testing::HasSubstr;

TEST(Detection, ATrainedDatabaseStartsTheTrackByItself) {
  const test::TemporaryFolder folder;
  const std::string sequence = (folder / "sequence").string();
  const ProgramResult render = runDiorama({"render", "scenes/orange_juice.yaml", "-o", sequence,
                                           "--frames", "0:12", "--quality", "draft"},
                                          folder);
  ASSERT_EQ(render.code, 0) << render.err;
  const ProgramResult train = runDiorama(
      {"train", "orange_juice_carton", "-o", (folder / "carton.db").string(), "--set", "views=30"},
      folder);
  ASSERT_EQ(train.code, 0) << train.err;
  EXPECT_THAT(train.out, HasSubstr("features in 90 views of 0.096 x"));

  // The sequence names the database, and its own initial pose is not looked at.
  const auto yaml = std::filesystem::path(sequence) / "sequence.yaml";
  std::string text = readFile(yaml);
  const size_t at = text.find("initial_T_camera_object");
  ASSERT_NE(at, std::string::npos);
  text.insert(at, "database: ../carton.db\n    ");
  writeFileAtomically(yaml, text);
  for (const char* method : {"ebt", "fused"}) {
    const ProgramResult run =
        runDiorama({"run", sequence, "-o", (folder / method).string(), "--method", method,
                    "--initial", "detect", "--no-video", "--expect", "success_5cm_5deg>=0.9",
                    "--expect", "mean_error_m<=0.010", "--expect", "false_claim_ratio==0"},
                   folder);
    EXPECT_EQ(run.code, 0) << run.err;
    EXPECT_THAT(readFile(folder / method / "events.csv"), HasSubstr("orange_juice,detected,"));
    EXPECT_EQ(metricsFromJson(folder / method / "metrics.json").initial, "detect");
  }

  std::string damaged = readFile(folder / "carton.db");
  damaged[damaged.size() / 2] ^= 1;
  writeFileAtomically(folder / "carton.db", damaged);
  const ProgramResult run =
      runDiorama({"run", sequence, "-o", (folder / "x").string(), "--initial", "detect"}, folder);
  EXPECT_EQ(run.code, kExitBadData);
  EXPECT_THAT(run.err, HasSubstr("carton.db: the database is damaged"));
  EXPECT_FALSE(std::filesystem::exists(folder / "x"));
}

// Edges do not tell how a tin is turned: its print does, and what was known at the start.
TEST(Detection, ATinIsFollowedAsItIsTurned) {
  const test::TemporaryFolder folder;
  folder.write("tin.yaml", R"(
camera: {width: 640, height: 480, fx: 610, fy: 610, cx: 319.5, cy: 239.5, rate_hz: 30}
duration_s: 0.5
environment: plain_room
objects: [{name: tin, model: can_tomato, on: table, at: [0, 0], yaw_rad: 2.1, track: true}]
path: {type: orbit, center: [0, 0, 0.05], radius_m: 0.4, height_m: 0.2, start_rad: -2.2, rate_rad_s: 1}
)");
  const ProgramResult run = runDiorama(
      {"run", (folder / "tin.yaml").string(), "-o", (folder / "run").string(), "--quality", "draft",
       "--method", "ebt", "--initial", "given", "--no-video", "--expect", "success_5cm_5deg==1"},
      folder);
  EXPECT_EQ(run.code, 0) << run.out << run.err;
}

TEST(Detection, SayWhatIsWrongWithTraining) {
  const test::TemporaryFolder folder;
  const ProgramResult missing =
      runDiorama({"train", "orange_juice_cartn", "-o", (folder / "a.db").string()}, folder);
  EXPECT_EQ(missing.code, kExitMissingInput);
  EXPECT_THAT(missing.err, HasSubstr("did you mean `orange_juice_carton`?"));
  const ProgramResult option = runDiorama(
      {"train", "mug", "-o", (folder / "a.db").string(), "--set", "features=orb"}, folder);
  EXPECT_EQ(option.code, kExitBadData);
  EXPECT_THAT(option.err, HasSubstr("sift"));
  EXPECT_FALSE(std::filesystem::exists(folder / "a.db"));
}

}  // namespace
}  // namespace diorama
