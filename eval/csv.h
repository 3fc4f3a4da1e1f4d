// Comma-separated tables (RFC 4180) as the run and sweep folders hold them.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace diorama {

// One field, quoted when it must be.
std::string csvField(const std::string& text);
// Fields joined to one line, with its end.
std::string csvLine(const std::vector<std::string>& fields);

struct CsvTable {
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;  // as long as the header

  // Its position in the header; nothing when there is no such column.
  std::optional<size_t> column(std::string_view name) const;
};

// Rows that are shorter than the header are filled with empty fields, longer ones cut; empty lines
// are left out. Any text gives a table.
CsvTable parseCsv(std::string_view text);

}  // namespace diorama
