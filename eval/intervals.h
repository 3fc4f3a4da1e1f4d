// Confidence intervals, 95%.
#pragma once

#include <cstdint>
#include <optional>
#include <span>

namespace diorama {

struct Interval {
  double mean = 0, low = 0, high = 0;
};

// Of a share: E. B. Wilson, Probable inference, the law of succession, and statistical inference,
// JASA 1927. `trials` must be positive, `share` in [0, 1]; successes need not be a whole number.
Interval wilsonInterval(double share, double trials);

// Of a mean: percentiles of the means of 2000 resamples (Efron 1979), the same for the same values
// and seed. Nothing for no values; one value has no width.
std::optional<Interval> bootstrapInterval(std::span<const double> values, uint64_t seed = 1);

}  // namespace diorama
