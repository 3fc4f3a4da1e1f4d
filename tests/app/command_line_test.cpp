// The program as its users see it: exit codes, one-line errors, nothing half-written.
#include "app/command_line.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/errors.h"
#include "core/files.h"
#include "tests/support/program.h"

namespace diorama {
namespace {

using test::ProgramResult;
using test::runDiorama;

void expectOneLine(const ProgramResult& result, int code, const std::string& part) {
  EXPECT_EQ(result.code, code) << result.err;
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
}

TEST(CommandLine, UsageErrors) {
  const test::TemporaryFolder folder;
  const std::string out = (folder / "out").string();
  expectOneLine(runDiorama({"rendre"}, folder), kExitUsage, "did you mean `render`");
  expectOneLine(runDiorama({}, folder), kExitUsage, "subcommand");
  expectOneLine(runDiorama({"run"}, folder), kExitUsage, "required");
  const std::string scene = "scenes/orange_juice.yaml";
  expectOneLine(runDiorama({"run", scene, "-o", out, "--method", "best"}, folder), kExitUsage,
                "vo, ebt, fused");
  expectOneLine(runDiorama({"run", scene, "-o", out, "--frames", "9"}, folder), kExitUsage, "A:B");
  expectOneLine(runDiorama({"run", scene, "-o", out, "--frames", "5:2"}, folder), kExitUsage,
                "A:B");
  expectOneLine(runDiorama({"run", scene, "-o", out, "--expect", "good"}, folder), kExitUsage,
                "METRIC>=VALUE");
  expectOneLine(runDiorama({"run", scene, "-o", out, "--set", "seed"}, folder), kExitUsage,
                "key.path=value");
  expectOneLine(runDiorama({"render", scene, "-o", out, "--quality", "best"}, folder), kExitUsage,
                "draft");
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST(CommandLine, TheHelpThatIsNamedIsThatOfTheCommand) {
  const test::TemporaryFolder folder;
  expectOneLine(runDiorama({"run"}, folder), kExitUsage, "see diorama run --help");
  expectOneLine(runDiorama({"train", "mug", "--scael", "1"}, folder), kExitUsage,
                "unknown option `--scael`; did you mean `--scale`?; see diorama train --help");
  expectOneLine(runDiorama({"rnu"}, folder), kExitUsage,
                "unknown command `rnu`; did you mean `run`?; see diorama --help");
}

TEST(CommandLine, HelpAndVersionSucceed) {
  const test::TemporaryFolder folder;
  EXPECT_EQ(runDiorama({"--help"}, folder).code, 0);
  EXPECT_EQ(runDiorama({"run", "--help"}, folder).code, 0);
  EXPECT_EQ(runDiorama({"--version"}, folder).code, 0);
}

TEST(CommandLine, TheRasterRendererRefusesARollingShutter) {
  const test::TemporaryFolder folder;
  const std::string out = (folder / "out").string();
  expectOneLine(runDiorama({"render", "scenes/stress/rolling_shutter.yaml", "-o", out, "--renderer",
                            "raster", "--frames", "0:1", "--quality", "draft"},
                           folder),
                kExitBadData,
                "rolling_shutter.yaml: camera.row_time_s: the raster renderer has no rolling "
                "shutter; use --renderer ray");
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST(CommandLine, DoctorFindsWhatThereIs) {
  const test::TemporaryFolder folder;
  const ProgramResult result = runDiorama({"doctor"}, folder);
  EXPECT_EQ(result.code, 0) << result.out;
  EXPECT_NE(result.out.find("ok   OSMesa"), std::string::npos) << result.out;
  EXPECT_EQ(result.out.find("BAD"), std::string::npos) << result.out;
}

TEST(CommandLine, MissingAndBadInput) {
  const test::TemporaryFolder folder;
  const std::string out = (folder / "out").string();
  expectOneLine(runDiorama({"run", "nowhere.yaml", "-o", out}, folder), kExitMissingInput,
                "nowhere.yaml");
  expectOneLine(runDiorama({"render", "nowhere.yaml", "-o", out}, folder), kExitMissingInput,
                "nowhere.yaml");
  expectOneLine(runDiorama({"eval", "a.txt", "b.txt"}, folder), kExitMissingInput, "a.txt");
  const std::string scene = "scenes/orange_juice.yaml";
  expectOneLine(runDiorama({"render", scene, "-o", out, "--set", "camera.widht=640"}, folder),
                kExitBadData, "width");
  expectOneLine(runDiorama({"render", scene, "-o", out, "--set", "camera.width=0"}, folder),
                kExitBadData, "between 1 and 16384");
  expectOneLine(runDiorama({"run", scene, "-o", out, "--set", "tracker.max_sample=9"}, folder),
                kExitBadData, "max_samples");
  expectOneLine(runDiorama({"run", folder.path().string(), "-o", out}, folder), kExitMissingInput,
                "sequence.yaml");
  EXPECT_FALSE(std::filesystem::exists(out));
}

TEST(CommandLine, OutputThatCannotBeWritten) {
  const test::TemporaryFolder folder;
  writeFileAtomically(folder / "file", "mine");
  const std::vector<std::string> arguments = {"render",   "scenes/orange_juice.yaml",
                                              "-o",       (folder / "file/seq").string(),
                                              "--frames", "0:1"};
  expectOneLine(runDiorama(arguments, folder), kExitOutput, "file");
  EXPECT_EQ(readFile(folder / "file"), "mine");
  expectOneLine(runDiorama({"render", "scenes/orange_juice.yaml", "-o", "/proc/diorama"}, folder),
                kExitOutput, "/proc");
}

TEST(CommandLine, EvalPrintsATableOrJson) {
  const test::TemporaryFolder folder;
  std::string truth, estimate;
  for (int k = 0; k < 5; ++k) {
    const std::string time = std::to_string(k) + ".000000 ";
    truth += time + std::to_string(0.1 * k) + " " + std::to_string(0.01 * k * k) + " 0 0 0 0 1\n";
    estimate += time + std::to_string(0.1 * k + 1) + " " + std::to_string(0.01 * k * k) +
                " 0.002 0 0 0 1\n";
  }
  writeFileAtomically(folder / "truth.txt", truth);
  writeFileAtomically(folder / "estimate.txt", estimate);
  const std::string a = (folder / "estimate.txt").string(), b = (folder / "truth.txt").string();
  const ProgramResult table = runDiorama({"eval", a, b}, folder);
  EXPECT_EQ(table.code, 0);
  EXPECT_NE(table.out.find("ape_trans_m"), std::string::npos);
  const ProgramResult json = runDiorama({"eval", a, b, "--align", "none", "--json"}, folder);
  EXPECT_NE(json.out.find("\"matched\": 5"), std::string::npos);
  expectOneLine(runDiorama({"eval", a, b, "--align", "sim4"}, folder), kExitUsage, "sim3");
  writeFileAtomically(folder / "broken.txt", "0.0 1 2 3\n");
  expectOneLine(runDiorama({"eval", (folder / "broken.txt").string(), b}, folder), kExitBadData,
                "broken.txt:1");
}

TEST(FrameRange, HalfOpenWithOpenEnds) {
  EXPECT_EQ(framesOf(parseFrameRange("2:5"), 10), (std::vector<int>{2, 3, 4}));
  EXPECT_EQ(framesOf(parseFrameRange(":3"), 10), (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(framesOf(parseFrameRange("8:"), 10), (std::vector<int>{8, 9}));
  EXPECT_EQ(framesOf(parseFrameRange(":"), 7, 3), (std::vector<int>{0, 3, 6}));
  EXPECT_EQ(framesOf(parseFrameRange("8:99"), 10), (std::vector<int>{8, 9}));
  EXPECT_THROW(framesOf(parseFrameRange("10:11"), 10), UsageError);
  for (const char* text : {"", "3", "a:b", "-1:2", "1:2:3", "4:4", "1.5:2"})
    EXPECT_THROW(parseFrameRange(text), UsageError) << text;
}

}  // namespace
}  // namespace diorama
