// The paper's tables from our runs, the published figures beside them.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "eval/error_figure.h"
#include "eval/metrics.h"
#include "eval/table.h"

namespace diorama {

inline constexpr std::array<const char*, 3> kMethods = {"vo", "ebt", "fused"};

// The three runs of one scene, in the order of kMethods.
struct ReproducedSequence {
  std::string title;
  std::array<std::filesystem::path, 3> folders;
  std::array<Metrics, 3> metrics;
};

struct ReproducedTable {
  std::string title, note;
  Table table;
};

// In the order of kPaper. Throws InputError for folders that are no runs'.
std::vector<ReproducedTable> reproducedTables(const std::vector<ReproducedSequence>& sequences);

// The mean error and the gain over the tracker alone, ours and the paper's, and ours where every
// method answers. Of what is missing when something is.
std::string headline(const std::vector<ReproducedSequence>& sequences);

std::vector<ErrorPanel> errorPanels(const std::vector<ReproducedSequence>& sequences);

std::string toMarkdown(const std::vector<ReproducedTable>& tables);

}  // namespace diorama
