// Sequences end to end: written in all formats, gone on with after a kill, proved, streamed, run.
#include <gtest/gtest.h>

#include "core/errors.h"
#include "core/files.h"
#include "tests/support/program.h"

namespace diorama {
namespace {

namespace fs = std::filesystem;
using test::ProgramResult;
using test::runDiorama;
using test::runShell;
using test::shellQuoted;

std::vector<std::string> render(const std::string& output, const std::string& frames,
                                std::vector<std::string> more = {}) {
  std::vector<std::string> arguments = {
      "render", "scenes/orange_juice.yaml", "-o", output, "--frames", frames, "--quality", "draft"};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

std::string shellLine(const std::vector<std::string>& arguments) {
  std::string line = shellQuoted(DIORAMA_BINARY);
  for (const std::string& argument : arguments) line += " " + shellQuoted(argument);
  return line;
}

TEST(Sequences, KilledInMidFrameAndResumedTheBytesAreTheSame) {
  const test::TemporaryFolder folder;
  const std::string whole = folder / "whole", killed = folder / "killed", part = folder / "part";
  ASSERT_EQ(runDiorama(render(whole, "0:40"), folder).code, 0);
  const ProgramResult kill =
      runShell(shellLine(render(killed, "0:40")) +
                   " & pid=$!\n"
                   "while [ \"$(ls " +
                   shellQuoted(killed + "/partial") +
                   " 2>/dev/null | wc -l)\" -lt 5 ]; do sleep 0.002; done\nkill -9 $pid; wait $pid",
               DIORAMA_SOURCE_DIR, folder);
  EXPECT_EQ(kill.code, 137);
  ASSERT_FALSE(fs::exists(killed + "/manifest.csv"));
  EXPECT_EQ(runDiorama(render(killed, "0:40"), folder).code, kExitOutput);
  const ProgramResult resumed = runDiorama(render(killed, "0:40", {"--resume"}), folder);
  ASSERT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_EQ(readFile(killed + "/manifest.csv"), readFile(whole + "/manifest.csv"));
  EXPECT_FALSE(fs::exists(killed + "/partial"));
  EXPECT_EQ(runDiorama({"check", killed}, folder).code, 0);

  ASSERT_EQ(runDiorama(render(part, "20:23"), folder).code, 0);
  for (const char* file : {"rgb/000021.png", "depth/000020.png", "mask/000022_000000.png"})
    EXPECT_EQ(readFile(part + "/" + file), readFile(whole + "/" + file)) << file;
}

TEST(Sequences, CheckNamesTheFileThatWasChanged) {
  const test::TemporaryFolder folder;
  const std::string sequence = folder / "sequence";
  ASSERT_EQ(runDiorama(render(sequence, "0:6"), folder).code, 0);
  const ProgramResult good = runDiorama({"check", sequence, "--json"}, folder);
  EXPECT_EQ(good.code, 0) << good.out;
  EXPECT_NE(good.out.find("\"good\": true"), std::string::npos);
  std::string poses = readFile(sequence + "/groundtruth.txt");
  const size_t line = poses.find("\n0.100000 ") + 10;
  const size_t end = poses.find(' ', line);
  const double x = std::stod(poses.substr(line, end - line)) + 0.005;
  writeFileAtomically(sequence + "/groundtruth.txt",
                      poses.replace(line, end - line, std::to_string(x)));
  fs::remove(sequence + "/manifest.csv");
  const ProgramResult bad = runDiorama({"check", sequence}, folder);
  EXPECT_EQ(bad.code, kExitMissed);
  EXPECT_NE(bad.out.find("groundtruth.txt: at 0.100000"), std::string::npos) << bad.out;
  EXPECT_EQ(runDiorama({"check", folder / "nothing"}, folder).code, kExitMissingInput);
}

TEST(Sequences, AllFormatsRunAndKeepTheirBytes) {
  const test::TemporaryFolder folder;
  const std::string all = folder / "all", tum = folder / "tum";
  ASSERT_EQ(runDiorama(render(all, "0:8", {"--format", "tum,bop,euroc"}), folder).code, 0);
  ASSERT_EQ(runDiorama(render(tum, "0:8"), folder).code, 0);
  EXPECT_EQ(readFile(all + "/rgb/000003.png"), readFile(tum + "/rgb/000003.png"));
  EXPECT_EQ(readFile(all + "/rgb/000003.png"), readFile(all + "/bop/test/000000/rgb/000003.png"));
  EXPECT_EQ(runDiorama({"check", all}, folder).code, 0);
  const auto run = [&](const std::string& input, std::vector<std::string> more) {
    std::vector<std::string> arguments = {"run",      input, "-o",        (folder / "run").string(),
                                          "--method", "ebt", "--no-video"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramResult result = runDiorama(arguments, folder);
    fs::remove_all(folder / "run");
    EXPECT_EQ(result.code, 0) << input << ": " << result.err;
  };
  run(all, {"--expect", "success_5cm_5deg==1"});
  run(all + "/bop", {"--expect", "success_5cm_5deg==1"});
  run(all + "/euroc", {"--objects", all + "/sequence.yaml"});
  const ProgramResult without = runDiorama(
      {"run", all + "/euroc", "-o", (folder / "run").string(), "--method", "ebt"}, folder);
  EXPECT_EQ(without.code, kExitBadData);
  EXPECT_NE(without.err.find("--objects FILE.yaml"), std::string::npos) << without.err;
}

TEST(Sequences, AStreamGoesIntoAPipeAndEndsWithIt) {
  const test::TemporaryFolder folder;
  const std::string line = shellLine(render("-", "0:3", {"--format", "y4m"}));
  const ProgramResult whole =
      runShell(line + " > " + shellQuoted(folder / "video.y4m"), DIORAMA_SOURCE_DIR, folder);
  EXPECT_EQ(whole.code, 0) << whole.err;
  const std::string video = readFile(folder / "video.y4m");
  const size_t head = video.find('\n') + 1;
  EXPECT_EQ(video.substr(0, 31), "YUV4MPEG2 W640 H480 F30:1 Ip A1");
  EXPECT_EQ(video.size(), head + 3 * (6 + 3 * 640 * 480));
  const std::string endless = shellLine(render("-", "0:300", {"--format", "y4m"}));
  const ProgramResult closed = runShell(
      "( " + endless + "; echo ended $? >&2 ) | head -c 99 >/dev/null", DIORAMA_SOURCE_DIR, folder);
  EXPECT_NE(closed.err.find("ended 0"), std::string::npos) << closed.err;
  EXPECT_EQ(runDiorama(render(folder / "file.y4m", "0:3", {"--format", "y4m"}), folder).code, 0);
  EXPECT_EQ(readFile(folder / "file.y4m"), video);
  EXPECT_EQ(runDiorama(render("-", "0:3"), folder).code, kExitUsage);
}

}  // namespace
}  // namespace diorama
