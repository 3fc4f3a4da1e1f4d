#include "core/text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <numeric>

namespace diorama {
namespace {

size_t editDistance(const std::string& a, const std::string& b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), size_t{0});
  for (size_t i = 1; i <= a.size(); ++i) {
    size_t diagonal = row[0];
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

}  // namespace

std::string formatNumber(double value) {
  std::array<char, 40> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value).ptr;
  return {buffer.data(), end};
}

std::string formatFixed(double value, int decimals) {
  std::array<char, 400> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                 std::chars_format::fixed, decimals)
                       .ptr;
  return {buffer.data(), end};
}

std::string formatSeconds(int64_t timestamp_ns) {
  const bool negative = timestamp_ns < 0;
  const uint64_t ns = negative ? uint64_t{0} - static_cast<uint64_t>(timestamp_ns)
                               : static_cast<uint64_t>(timestamp_ns);
  const uint64_t us = (ns + 500) / 1000;
  std::string fraction = std::to_string(us % 1000000);
  fraction.insert(0, 6 - fraction.size(), '0');
  return (negative && us > 0 ? "-" : "") + std::to_string(us / 1000000) + "." + fraction;
}

std::optional<double> parseNumber(std::string_view text) {
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<int64_t> parseInteger(std::string_view text) {
  int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<int64_t> parseSeconds(std::string_view text) {
  const size_t point = text.find('.');
  const std::string_view whole = text.substr(0, point);
  const std::optional<int64_t> seconds = parseInteger(whole);
  const bool plain =
      seconds && std::abs(*seconds) < std::numeric_limits<int64_t>::max() / 1000000001;
  if (!plain) {  // exponents and the like
    const std::optional<double> value = parseNumber(text);
    if (!value || !(std::abs(*value) < 9e9)) return std::nullopt;
    return static_cast<int64_t>(std::llround(*value * 1e9));
  }
  int64_t nanoseconds = 0;
  if (point != std::string_view::npos) {
    std::string digits(text.substr(point + 1));
    if (digits.empty() || digits.find_first_not_of("0123456789") != std::string::npos)
      return std::nullopt;
    digits.resize(9, '0');
    nanoseconds = *parseInteger(digits);
  }
  return *seconds * 1000000000 + (whole.front() == '-' ? -nanoseconds : nanoseconds);
}

std::vector<std::string_view> splitBlanks(std::string_view line) {
  std::vector<std::string_view> fields;
  size_t i = 0;
  while (true) {
    i = line.find_first_not_of(" \t\r", i);
    if (i == std::string_view::npos) return fields;
    const size_t end = std::min(line.find_first_of(" \t\r", i), line.size());
    fields.push_back(line.substr(i, end - i));
    i = end;
  }
}

std::vector<std::string_view> split(std::string_view line, char separator) {
  std::vector<std::string_view> fields;
  size_t begin = 0;
  while (true) {
    const size_t end = line.find(separator, begin);
    fields.push_back(line.substr(begin, end - begin));
    if (end == std::string_view::npos) return fields;
    begin = end + 1;
  }
}

std::string_view trim(std::string_view text) {
  const size_t begin = text.find_first_not_of(" \t\r\n");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t\r\n") - begin + 1);
}

std::string indented(std::string_view text) {
  std::string out;
  for (std::string_view line : split(text, '\n'))
    if (!line.empty()) out += "  " + std::string(line) + "\n";
  return out;
}

std::string formatPose(const SE3& pose, char separator) {
  const Vector3d& t = pose.translation;
  const Eigen::Quaterniond& q = pose.rotation;
  std::string text = formatNumber(t.x());
  for (double v : {t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) text += separator + formatNumber(v);
  return text;
}

std::optional<SE3> parsePose(const std::vector<std::string_view>& fields, size_t first) {
  std::array<double, 7> v{};
  if (fields.size() < first + v.size()) return std::nullopt;
  for (size_t i = 0; i < v.size(); ++i) {
    const std::optional<double> value = parseNumber(fields[first + i]);
    if (!value || !std::isfinite(*value)) return std::nullopt;
    v[i] = *value;
  }
  Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
  const double norm = q.norm();
  if (!std::isfinite(norm) || norm < 1e-6) return std::nullopt;
  // A quaternion that is unit already keeps its digits, so that writing and reading gives the same
  // bytes.
  if (std::abs(norm - 1) > 1e-12) q.normalize();
  return SE3{q, {v[0], v[1], v[2]}};
}

std::string nearestName(const std::string& name, const std::vector<std::string>& candidates) {
  std::string best;
  size_t best_distance = std::max<size_t>(2, name.size() / 2);
  for (const std::string& candidate : candidates) {
    // A missing unit (rate for rate_hz) is one slip.
    const bool begins = name.size() >= 3 && candidate.starts_with(name);
    const size_t distance = begins ? 1 : editDistance(name, candidate);
    if (distance < best_distance || (distance == best_distance && best.empty())) {
      best = candidate;
      best_distance = distance;
    }
  }
  return best;
}

std::string didYouMean(const std::string& name, const std::vector<std::string>& candidates) {
  const std::string near = nearestName(name, candidates);
  return near.empty() ? "" : "; did you mean `" + near + "`?";
}

}  // namespace diorama
