// How many threads there are to use.
#pragma once

#include <algorithm>
#include <thread>

namespace diorama {

inline int workerCount() {
  return static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
}

}  // namespace diorama
