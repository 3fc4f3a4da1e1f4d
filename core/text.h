// Numbers as text that do not depend on the locale and read back to the same value.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/se3.h"

namespace diorama {

// The shortest text that reads back to the same double ("nan", "inf" for those).
std::string formatNumber(double value);
std::string formatFixed(double value, int decimals);

// Seconds with 6 decimals.
std::string formatSeconds(int64_t timestamp_ns);

std::optional<double> parseNumber(std::string_view text);    // the whole text; finite or not
std::optional<int64_t> parseInteger(std::string_view text);  // the whole text
std::optional<int64_t> parseSeconds(std::string_view text);  // decimal seconds to ns, exact to 1 ns

std::vector<std::string_view> splitBlanks(std::string_view line);  // by spaces and tabs
std::vector<std::string_view> split(std::string_view line, char separator);
std::string_view trim(std::string_view text);

// Every line of the text, two blanks in front.
std::string indented(std::string_view text);

// "tx ty tz qx qy qz qw", separated by `separator`.
std::string formatPose(const SE3& pose, char separator);
// The same from seven fields; nothing when one is no finite number or the quaternion is nearly
// zero.
std::optional<SE3> parsePose(const std::vector<std::string_view>& fields, size_t first);

// The candidate with the smallest edit distance, when it is near enough to be a slip; empty
// otherwise.
std::string nearestName(const std::string& name, const std::vector<std::string>& candidates);
// "; did you mean `that`?" for the end of a complaint; empty when there is none.
std::string didYouMean(const std::string& name, const std::vector<std::string>& candidates);

}  // namespace diorama
