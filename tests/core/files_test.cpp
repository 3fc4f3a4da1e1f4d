#include "core/files.h"

#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <thread>

#include "core/errors.h"
#include "tests/support/temporary_folder.h"

namespace diorama {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)
namespace fs = std::filesystem;

size_t entries(const fs::path& folder) {
  return static_cast<size_t>(
      std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

TEST(Files, WritesAndReplacesWholeFiles) {
  TemporaryFolder folder;
  const fs::path file = folder.path() / "a.txt";
  const std::string bytes("one\0two\r\n\xff", 10);
  writeFileAtomically(file, bytes);
  EXPECT_EQ(readFile(file), bytes);
  writeFileAtomically(file, "");
  EXPECT_EQ(readFile(file), "");
  EXPECT_EQ(entries(folder.path()), 1u);
}

TEST(Files, ReadsPipes) {
  TemporaryFolder folder;
  const fs::path pipe = folder.path() / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const std::string bytes(200000, 'x');  // more than a pipe holds
  std::jthread writer([&] { std::ofstream(pipe) << bytes; });
  EXPECT_EQ(readFile(pipe), bytes);
}

TEST(Files, PieceByPieceOrNotAtAll) {
  TemporaryFolder folder;
  const fs::path file = folder.write("a.txt", "old");
  {
    AtomicFile out(file);
    out.write("one ");
    out.write("two");
    EXPECT_EQ(readFile(file), "old");
    out.commit();
  }
  EXPECT_EQ(readFile(file), "one two");
  { AtomicFile(file).write("three"); }
  EXPECT_EQ(readFile(file), "one two");
  EXPECT_EQ(entries(folder.path()), 1u);
}

TEST(Files, MissingInput) {
  TemporaryFolder folder;
  EXPECT_THROW(readFile(folder.path() / "none"), MissingInputError);
  EXPECT_THROW(readFile(folder.path()), MissingInputError);
  EXPECT_THROW(readFile(""), MissingInputError);
}

TEST(Files, UnwritablePlacesAreOutputErrors) {
  TemporaryFolder folder;
  EXPECT_THROW(writeFileAtomically(folder.path() / "no" / "such" / "folder", "x"), OutputError);
  const fs::path file = folder.write("file", "old");
  EXPECT_THROW(writeFileAtomically(file / "below", "x"), OutputError);
  // Onto a folder: the rename fails, and the partial file goes.
  fs::create_directory(folder.path() / "taken");
  EXPECT_THROW(writeFileAtomically(folder.path() / "taken", "x"), OutputError);
  EXPECT_EQ(entries(folder.path()), 2u);
  EXPECT_THROW(createFolder(file / "below"), OutputError);
  EXPECT_THROW(writeFileAtomically("/proc/nothing", "x"), OutputError);
  EXPECT_EQ(readFile(file), "old");
}

TEST(Files, ReadOnlyFolder) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may write anywhere";
  TemporaryFolder folder;
  fs::permissions(folder.path(), fs::perms::owner_read | fs::perms::owner_exec);
  EXPECT_THROW(writeFileAtomically(folder.path() / "a", "x"), OutputError);
  fs::permissions(folder.path(), fs::perms::owner_all);
}

// A write that fails half-way, as on a full disk (a limit on the size of files does the same).
TEST(Files, NoPartialFileIsLeftWhenTheDiskIsFull) {
  TemporaryFolder folder;
  const fs::path file = folder.write("a.txt", "old");
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 4096;
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  const std::string message =
      messageOf<OutputError>([&] { writeFileAtomically(file, std::string(100'000, 'x')); });
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
  EXPECT_THAT(message, testing::HasSubstr("a.txt"));
  EXPECT_EQ(readFile(file), "old");
  EXPECT_EQ(entries(folder.path()), 1u);
}

TEST(Files, ErrorsCarryTheirExitCodes) {
  EXPECT_EQ(OutputError("f", "w").code(), kExitOutput);
  EXPECT_EQ(MissingInputError("f").code(), kExitMissingInput);
  EXPECT_EQ(InputError(fs::path("f"), "w").code(), kExitBadData);
  EXPECT_EQ(UsageError("w").code(), kExitUsage);
  EXPECT_STREQ(InputError(SourcePlace{"f", 3, 4}, "wrong", "mend it").what(),
               "f:3:4: wrong; mend it");
  EXPECT_STREQ(InputError(SourcePlace{"f", 0, 4}, "wrong").what(), "f: wrong");
}

TEST(Files, FoldersFromTheEnvironment) {
  ::setenv("DIORAMA_CACHE", "/some/cache", 1);
  EXPECT_EQ(cacheFolder(), "/some/cache");
  ::unsetenv("DIORAMA_CACHE");
  ::setenv("DIORAMA_DATA", "/some/data", 1);
  EXPECT_EQ(dataFolder(), "/some/data");
  ::unsetenv("DIORAMA_DATA");
}

}  // namespace
}  // namespace diorama
