// metrics.json, and the conditions that users put on it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "eval/metrics.h"

namespace diorama {

// Unknown values are null; never absent, never NaN.
std::string toJson(const Metrics& metrics);

// Reads metrics.json back; throws MissingInputError or InputError.
Metrics metricsFromJson(const std::filesystem::path& file);
// The same from a text that stands in that file.
Metrics metricsFromText(const std::string& content, const std::filesystem::path& file);

// `METRIC>=VALUE` (also <=, >, <, ==, !=). METRIC is a dotted path (camera.ate_mean_m), or a last
// name that stands for all places where it occurs (success_5cm_5deg: of every object).
class Expectation {
 public:
  // Throws UsageError.
  explicit Expectation(const std::string& text);
  // Throws UsageError for a metric that does not exist, with the nearest name. Its value may be
  // unknown yet.
  void check(const Metrics& metrics) const;
  // Nothing when it holds, else one line that says by how much it is missed. An unknown value
  // misses. Throws as check().
  std::string missed(const Metrics& metrics) const;

 private:
  bool isAbout(const MetricValue& metric) const;  // by its name, or the end of it
  bool holds(double value) const;

  std::string text_, metric_, relation_;
  double bound_ = 0;
};

}  // namespace diorama
