#include "app/progress.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "core/text.h"

namespace diorama {
namespace {

constexpr double kTerminalInterval_s = 0.1;
constexpr double kPlainInterval_s = 5;
constexpr int kBarWidth = 24;

std::string bar(double fraction) {
  const int filled = static_cast<int>(fraction * kBarWidth);
  std::string text;
  for (int i = 0; i < kBarWidth; ++i) text += i < filled ? "█" : "░";
  return text;
}

}  // namespace

bool terminalWanted() {
  const char* no_color = std::getenv("NO_COLOR");
  return ::isatty(STDERR_FILENO) && !(no_color && *no_color);
}

void noteBaking() {
  std::fputs("baking the light of the scene, which is kept for the next time\n", stderr);
}

Progress::Progress(std::string title, int total, std::string unit)
    : title_(std::move(title)),
      unit_(std::move(unit)),
      total_(std::max(1, total)),
      terminal_(terminalWanted()) {}

Progress::~Progress() {
  if (line_open_) std::fputc('\n', stderr);
}

void Progress::update(int done, const std::string& detail) {
  const double elapsed = watch_.seconds();
  const bool last = done >= total_;
  if (!last && elapsed - shown_s_ < (terminal_ ? kTerminalInterval_s : kPlainInterval_s)) return;
  shown_s_ = elapsed;
  const double rate = done / std::max(1e-9, elapsed);
  std::string line = title_ + " " + std::to_string(done) + "/" + std::to_string(total_) + "  " +
                     formatFixed(rate, 1) + " " + unit_ + "/s";
  if (!last) line += "  " + formatFixed((total_ - done) / std::max(1e-9, rate), 0) + " s left";
  if (!detail.empty()) line += "  " + detail;
  if (terminal_) {
    const double fraction = static_cast<double>(done) / total_;
    std::fprintf(stderr, "\r\033[K%s %s", bar(fraction).c_str(), line.c_str());
    line_open_ = true;
  } else {
    std::fprintf(stderr, "%s\n", line.c_str());
  }
  std::fflush(stderr);
}

}  // namespace diorama
