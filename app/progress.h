// Progress on standard error: one live line on a terminal, a plain line now and then elsewhere.
#pragma once

#include <string>

#include "app/stopwatch.h"

namespace diorama {

class Progress {
 public:
  Progress(std::string title, int total, std::string unit = "frames");
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  // `done` of the total; `detail` is added to the line.
  void update(int done, const std::string& detail = "");

 private:
  std::string title_, unit_;
  int total_;
  bool terminal_;
  Stopwatch watch_;
  double shown_s_ = 0;
  bool line_open_ = false;
};

// Whether standard error is a terminal that wants more than plain text.
bool terminalWanted();

// Says that the light of a scene is baked now, since nothing else happens for a while.
void noteBaking();

}  // namespace diorama
