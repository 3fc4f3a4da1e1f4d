// Summary of a list of errors.
#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace diorama {

struct Statistics {
  size_t count = 0;
  double mean = 0;
  double std = 0;     // of the population (divided by count), as evo has it
  double median = 0;  // of an even count: the mean of the two in the middle
  double rmse = 0;
  double min = 0;
  double max = 0;
};

// Nothing for an empty list. The values must be finite.
std::optional<Statistics> summarise(std::span<const double> values);

}  // namespace diorama
