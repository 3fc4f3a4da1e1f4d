// Work on many small things in jobs of some each.
#pragma once

#include <algorithm>
#include <cstddef>

#include "sim/worker_pool.h"

namespace diorama {

// Calls fn(k) for k in [0, count), `chunk_size` of them a job.
template <class Fn>
void forChunks(size_t count, size_t chunk_size, WorkerPool& pool, const Fn& fn) {
  pool.run(static_cast<int>((count + chunk_size - 1) / chunk_size), [&](int chunk) {
    const size_t first = static_cast<size_t>(chunk) * chunk_size;
    for (size_t k = first; k < std::min(count, first + chunk_size); ++k) fn(k);
  });
}

}  // namespace diorama
