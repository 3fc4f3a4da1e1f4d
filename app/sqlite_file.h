// Tables as one SQLite file.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "eval/csv.h"

namespace diorama {

struct NamedTable {
  std::string name;
  const CsvTable* table;
};

// Fields that are numbers become numbers, empty ones NULL. No half-written file is left; throws
// OutputError.
void writeSqlite(const std::filesystem::path& file, const std::vector<NamedTable>& tables);

}  // namespace diorama
