#include "app/growing_files.h"

#include <gtest/gtest.h>

#include "core/errors.h"
#include "tests/support/temporary_folder.h"

namespace diorama {
namespace {

namespace fs = std::filesystem;

TEST(GrowingFiles, AppearTogetherAndWhole) {
  const test::TemporaryFolder folder;
  GrowingFiles files(folder.path());
  std::string rows;
  for (int k = 0; k < 20000; ++k) {
    const std::string row = std::to_string(k) + ",row\n";
    files.append("truth/rows.csv", row);
    rows += row;
  }
  files.append("empty.txt", "");
  EXPECT_FALSE(fs::exists(folder.path() / "truth/rows.csv"));
  EXPECT_FALSE(fs::exists(folder.path() / "empty.txt"));
  files.commit();
  EXPECT_EQ(readFile(folder.path() / "truth/rows.csv"), rows);
  EXPECT_EQ(readFile(folder.path() / "empty.txt"), "");
}

TEST(GrowingFiles, LeaveNothingWithoutCommit) {
  const test::TemporaryFolder folder;
  GrowingFiles(folder.path()).append("rows.csv", "1\n");
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(GrowingFiles, AFolderThatIsNoneIsAnError) {
  const test::TemporaryFolder folder;
  writeFileAtomically(folder.path() / "file", "");
  GrowingFiles files(folder.path() / "file");
  EXPECT_THROW(files.append("rows.csv", "1\n"), OutputError);
}

}  // namespace
}  // namespace diorama
