// The report as one HTML file that needs nothing else: page, style, scripts and data.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace diorama {

struct ReportContent {
  std::string title;
  std::string data;                 // JSON; what is in it is described in app/run_report.h
  std::vector<std::string> videos;  // MP4 files' bytes, one per run; empty = none
};

std::string reportPage(const ReportContent& content);

// Text that means itself in HTML, also within quotes.
std::string htmlEscaped(std::string_view text);
// JSON that can stand in a <script> element: no `<` is left in it.
std::string scriptSafeJson(std::string_view json);
std::string base64(std::string_view bytes);

}  // namespace diorama
