#include "app/output_folder.h"

#include <gtest/gtest.h>

#include "core/errors.h"
#include "core/files.h"
#include "tests/support/temporary_folder.h"

namespace diorama {
namespace {

OutputRequest requestFor(const test::TemporaryFolder& folder, const std::string& recipe) {
  return {folder / "out", "recipe.yaml", "done.csv", recipe};
}

TEST(OutputFolder, FreshThenIncompleteThenComplete) {
  const test::TemporaryFolder folder;
  OutputRequest request = requestFor(folder, "a: 1\n");
  EXPECT_EQ(prepareOutput(request), OutputState::kFresh);
  EXPECT_EQ(readFile(folder / "out/recipe.yaml"), "a: 1\n");
  EXPECT_THROW(prepareOutput(request), OutputError);
  request.resume = true;
  EXPECT_EQ(prepareOutput(request), OutputState::kResumed);
  writeFileAtomically(folder / "out/done.csv", "");
  request.resume = false;
  EXPECT_EQ(prepareOutput(request), OutputState::kComplete);
}

TEST(OutputFolder, RefusesOtherContent) {
  const test::TemporaryFolder folder;
  prepareOutput(requestFor(folder, "a: 1\n"));
  EXPECT_THROW(prepareOutput(requestFor(folder, "a: 2\n")), OutputError);
  createFolder(folder / "home");
  writeFileAtomically(folder / "home/letter.txt", "dear");
  EXPECT_THROW(prepareOutput({folder / "home", "recipe.yaml", "done.csv", "a: 1\n"}), OutputError);
  EXPECT_EQ(readFile(folder / "home/letter.txt"), "dear");
  EXPECT_THROW(prepareOutput({folder / "home/letter.txt", "recipe.yaml", "done.csv", "a: 1\n"}),
               OutputError);
}

}  // namespace
}  // namespace diorama
