// When a recording of another program is meant for a frame.
#pragma once

#include <cstdint>
#include <cstdlib>

namespace diorama {

// Half a millisecond: some programs write whole ones.
inline constexpr int64_t kSameTime_ns = 500'000;

inline bool isSameTime(int64_t a_ns, int64_t b_ns) { return std::abs(a_ns - b_ns) <= kSameTime_ns; }

}  // namespace diorama
