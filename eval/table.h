// Plain-text tables with aligned columns.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "eval/metrics.h"

namespace diorama {

struct Table {
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;  // shorter rows are filled with empty cells
};

// UTF-8. The first column is flush left, the others flush right; a line under the header.
std::string formatTable(const Table& table);

// The number with that many decimals, or a dash for nothing.
std::string formatCell(const std::optional<double>& value, int decimals, double factor = 1);

// The final tables of a run: camera, objects, time.
std::string formatMetrics(const Metrics& metrics);

}  // namespace diorama
