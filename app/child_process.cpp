#include "app/child_process.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <thread>

#include "app/command_line.h"
#include "app/stopwatch.h"
#include "core/errors.h"

namespace diorama {
namespace {

constexpr auto kPoll = std::chrono::milliseconds(10);

// Between fork and exec: only what is safe there.
[[noreturn]] void becomeChild(char* const* argv, int log, pid_t parent, const ChildLimits& limits) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (::getppid() != parent) ::_exit(127);  // it ended before the line above
  if (limits.file_mb > 0) {
    const rlim_t bytes = static_cast<rlim_t>(limits.file_mb * 1e6);
    const rlimit limit{bytes, bytes};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  const rlimit no_core{0, 0};
  ::setrlimit(RLIMIT_CORE, &no_core);
  ::setpgid(0, 0);  // an interrupt at the terminal is the parent's affair
  const int nothing = ::open("/dev/null", O_RDONLY);
  ::dup2(nothing, STDIN_FILENO);
  ::dup2(log, STDOUT_FILENO);
  ::dup2(log, STDERR_FILENO);
  ::execv(argv[0], argv);
  ::_exit(127);
}

struct Ended {
  explicit Ended(pid_t child) : pid(child) {}
  ~Ended() {
    if (pid <= 0) return;
    ::kill(pid, SIGKILL);
    ::waitpid(pid, nullptr, 0);
  }
  pid_t pid;
};

}  // namespace

ChildResult runChild(const std::vector<std::string>& command, const std::filesystem::path& log,
                     const ChildLimits& limits) {
  std::vector<char*> argv;
  for (const std::string& word : command) argv.push_back(const_cast<char*>(word.c_str()));
  argv.push_back(nullptr);
  const int log_file = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (log_file < 0) throw OutputError(log, std::strerror(errno));
  const Stopwatch watch;
  const pid_t parent = ::getpid();
  const pid_t pid = ::fork();
  if (pid == 0) becomeChild(argv.data(), log_file, parent, limits);
  ::close(log_file);
  if (pid < 0) throw OutputError(log, "no process can be made");
  Ended child(pid);
  ChildResult result;
  int status = 0;
  while (::waitpid(pid, &status, WNOHANG) == 0) {
    throwIfInterrupted();
    if (watch.seconds() > limits.time_s) {
      result.timed_out = true;
      ::kill(pid, SIGKILL);
    }
    std::this_thread::sleep_for(kPoll);
  }
  child.pid = 0;
  result.wall_s = watch.seconds();
  if (WIFEXITED(status)) result.exit_code = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) result.signal = WTERMSIG(status);
  return result;
}

std::filesystem::path thisProgram() { return std::filesystem::read_symlink("/proc/self/exe"); }

}  // namespace diorama
