#include "eval/report_page.h"

#include <cstdint>

#include "eval/report_assets.h"

namespace diorama {
namespace {

// Places are marked {{NAME}}; what is put in is not looked at again.
std::string filled(std::string_view page, const auto& contentOf) {
  std::string out;
  size_t at = 0;
  while (true) {
    const size_t begin = page.find("{{", at);
    const size_t end = begin == std::string_view::npos ? begin : page.find("}}", begin);
    if (end == std::string_view::npos) return out += page.substr(at);
    out += page.substr(at, begin - at);
    out += contentOf(page.substr(begin + 2, end - begin - 2));
    at = end + 2;
  }
}

}  // namespace

std::string htmlEscaped(std::string_view text) {
  std::string out;
  for (char c : text) {
    switch (c) {
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '&':
        out += "&amp;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string scriptSafeJson(std::string_view json) {
  std::string out;
  out.reserve(json.size());
  for (char c : json) c == '<' ? out += "\\u003c" : out += c;
  return out;
}

std::string base64(std::string_view bytes) {
  static constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t word = 0;
    for (size_t k = 0; k < 3; ++k)
      word = word << 8 | (i + k < bytes.size() ? static_cast<uint8_t>(bytes[i + k]) : 0u);
    for (size_t k = 0; k < 4; ++k)
      out += i + k > bytes.size() ? '=' : kDigits[word >> (18 - 6 * k) & 63];
  }
  return out;
}

std::string reportPage(const ReportContent& content) {
  return filled(reportAsset("report.html"), [&](std::string_view name) -> std::string {
    if (name == "TITLE") return htmlEscaped(content.title);
    if (name == "DATA") return scriptSafeJson(content.data);
    if (name == "VIDEOS") {
      std::string videos;
      for (size_t i = 0; i < content.videos.size(); ++i)
        videos += "<script type=\"application/octet-stream\" id=\"video" + std::to_string(i) +
                  "\">" + base64(content.videos[i]) + "</script>\n";
      return videos;
    }
    return std::string(reportAsset(name));
  });
}

}  // namespace diorama
