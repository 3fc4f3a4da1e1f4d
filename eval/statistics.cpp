#include "eval/statistics.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace diorama {

std::optional<Statistics> summarise(std::span<const double> values) {
  if (values.empty()) return std::nullopt;
  std::vector<double> sorted(values.begin(), values.end());
  std::sort(sorted.begin(), sorted.end());
  const size_t n = sorted.size();
  const double count = static_cast<double>(n);
  double sum = 0, squares = 0;
  for (double v : sorted) {
    sum += v;
    squares += v * v;
  }
  Statistics s;
  s.count = n;
  s.mean = sum / count;
  s.rmse = std::sqrt(squares / count);
  double variance = 0;  // in a second pass, where nothing cancels
  for (double v : sorted) variance += (v - s.mean) * (v - s.mean) / count;
  s.std = std::sqrt(variance);
  s.median = n % 2 ? sorted[n / 2] : 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]);
  s.min = sorted.front();
  s.max = sorted.back();
  return s;
}

}  // namespace diorama
