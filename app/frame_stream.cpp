#include "app/frame_stream.h"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>

#include "app/command_line.h"
#include "app/prefetcher.h"
#include "app/progress.h"
#include "app/workers.h"
#include "core/errors.h"
#include "sim/y4m_writer.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

// Standard output, or a file that gets its name when it is whole.
class Stream {
 public:
  explicit Stream(const std::string& output)
      : name_(output), partial_(output + ".partial"), to_pipe_(output == "-") {
    file_ = to_pipe_ ? stdout : std::fopen(partial_.c_str(), "wb");
    if (!file_) throw OutputError(name_, std::strerror(errno));
  }
  ~Stream() {
    if (to_pipe_ || !file_) return;
    std::fclose(file_);
    std::error_code ignored;
    fs::remove(partial_, ignored);
  }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;

  // Whether anybody reads on.
  bool write(const std::string& bytes) {
    errno = 0;
    if (std::fwrite(bytes.data(), 1, bytes.size(), file_) == bytes.size() &&
        std::fflush(file_) == 0)
      return true;
    if (to_pipe_ && errno == EPIPE) return false;
    throw OutputError(to_pipe_ ? "standard output" : name_, std::strerror(errno));
  }

  void finish() {
    if (to_pipe_) return;
    const bool closed = std::fclose(file_) == 0;
    file_ = nullptr;
    std::error_code error;
    if (closed) fs::rename(partial_, name_, error);
    if (!closed || error) {
      fs::remove(partial_, error);
      throw OutputError(name_, "could not be written");
    }
  }

 private:
  std::string name_, partial_;
  bool to_pipe_;
  std::FILE* file_;
};

}  // namespace

int streamY4m(FrameSource& source, const std::vector<int>& frames, double rate_hz,
              const std::string& output) {
  Stream stream(output);
  const Camera& camera = source.camera();
  Prefetcher prefetcher(source, frames, workerCount());
  Progress progress("filming", static_cast<int>(frames.size()));
  int written = 0;
  if (!stream.write(y4mHeader(camera.width(), camera.height(), rate_hz))) return written;
  while (!prefetcher.done()) {
    throwIfInterrupted();
    if (!stream.write(y4mFrame(prefetcher.next().frame.rgb))) return written;
    progress.update(++written);
  }
  stream.finish();
  return written;
}

}  // namespace diorama
