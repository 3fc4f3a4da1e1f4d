#include "eval/intervals.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace diorama {
namespace {

constexpr double kZ = 1.959963984540054;  // 97.5% of a standard normal lie below
constexpr int kResamples = 2000;

// SplitMix64 (Steele et al. 2014): enough to pick positions.
uint64_t next(uint64_t& state) {
  uint64_t z = state += 0x9e3779b97f4a7c15ull;
  z = (z ^ z >> 30) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ z >> 27) * 0x94d049bb133111ebull;
  return z ^ z >> 31;
}

}  // namespace

Interval wilsonInterval(double share, double trials) {
  const double z2 = kZ * kZ, n = trials;
  const double centre = (share + z2 / (2 * n)) / (1 + z2 / n);
  const double half = kZ / (1 + z2 / n) * std::sqrt(share * (1 - share) / n + z2 / (4 * n * n));
  return {share, std::max(0.0, centre - half), std::min(1.0, centre + half)};
}

std::optional<Interval> bootstrapInterval(std::span<const double> values, uint64_t seed) {
  if (values.empty()) return std::nullopt;
  const double n = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  std::vector<double> means(kResamples);
  for (double& resampled : means) {
    double sum = 0;
    for (size_t i = 0; i < values.size(); ++i) sum += values[next(seed) % values.size()];
    resampled = sum / n;
  }
  std::sort(means.begin(), means.end());
  return Interval{mean, means[kResamples * 25 / 1000], means[kResamples * 975 / 1000 - 1]};
}

}  // namespace diorama
