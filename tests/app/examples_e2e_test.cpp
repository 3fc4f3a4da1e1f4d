// The examples do what they say.
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>

#include "core/files.h"
#include "tests/support/program.h"

namespace diorama {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

test::ProgramResult runExample(const std::string& name, const std::string& arguments,
                               const test::TemporaryFolder& folder) {
  const fs::path program = fs::path(DIORAMA_BINARY).parent_path() / "examples" / name;
  return test::runShell(test::shellQuoted(program.string()) + " " + arguments, DIORAMA_SOURCE_DIR,
                        folder);
}

TEST(Examples, OwnTracker) {
  const test::TemporaryFolder folder;
  const test::ProgramResult result = runExample("own_tracker", "scenes/orange_juice.yaml", folder);
  EXPECT_EQ(result.code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("frame 0: off by 0.0 mm"));
  EXPECT_THAT(result.out, HasSubstr("frame 9: off by"));
  EXPECT_EQ(runExample("own_tracker", "none.yaml", folder).code, 66);
}

TEST(Examples, WriteSequence) {
  const test::TemporaryFolder folder;
  const fs::path sequence = folder / "sequence";
  const std::string arguments = "scenes/orange_juice.yaml " + test::shellQuoted(sequence.string());
  const test::ProgramResult result = runExample("write_sequence", arguments, folder);
  EXPECT_EQ(result.code, 0) << result.err;
  for (const char* name : {"rgb/000004.png", "depth/000000.png", "normal/000004.png",
                           "flow/000003_000004.png", "edges.csv", "manifest.csv"})
    EXPECT_TRUE(fs::exists(sequence / name)) << name;
}

TEST(Examples, AreShort) {
  for (const char* name : {"own_tracker", "write_sequence"}) {
    const std::string text =
        readFile(fs::path(DIORAMA_SOURCE_DIR) / "examples" / (std::string(name) + ".cpp"));
    EXPECT_LT(std::count(text.begin(), text.end(), '\n'), 40) << name;
  }
}

}  // namespace
}  // namespace diorama
