#include "app/child_process.h"

#include <gtest/gtest.h>

#include <atomic>
#include <csignal>

#include "app/task_queue.h"
#include "core/files.h"
#include "tests/support/temporary_folder.h"

namespace diorama {
namespace {

TEST(ChildProcess, TellsHowItEnded) {
  const test::TemporaryFolder folder;
  const auto run = [&](const std::string& script, const ChildLimits& limits = {}) {
    return runChild({"/bin/sh", "-c", script}, folder / "log.txt", limits);
  };
  EXPECT_TRUE(run("echo said").done());
  EXPECT_EQ(readFile(folder / "log.txt"), "said\n");
  EXPECT_EQ(run("exit 65").exit_code, 65);
  EXPECT_EQ(run("kill -SEGV $$").signal, SIGSEGV);
  EXPECT_TRUE(run("sleep 60", {0.1, 0}).timed_out);
  EXPECT_FALSE(
      run("exec head -c 100000 /dev/zero > '" + (folder / "big").string() + "'", {600, 0.01})
          .done());
  EXPECT_EQ(runChild({"/no/such/program"}, folder / "log.txt", {}).exit_code, 127);
}

TEST(TaskQueue, RunsWhatTasksAdd) {
  TaskQueue queue;
  std::atomic<int> done{0};
  for (int i = 0; i < 5; ++i)
    queue.add([&] {
      ++done;
      queue.addFirst([&] { ++done; });
    });
  queue.run(3);
  EXPECT_EQ(done, 10);
}

TEST(TaskQueue, ThrowsTheFirstFailure) {
  TaskQueue queue;
  queue.add([] { throw std::runtime_error("no"); });
  queue.add([] {});
  EXPECT_THROW(queue.run(1), std::runtime_error);
  TaskQueue empty;
  empty.run(2);
}

}  // namespace
}  // namespace diorama
