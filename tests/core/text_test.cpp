#include "core/text.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "tests/support/matchers.h"

namespace diorama {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)
using testing::ElementsAre;

TEST(Text, NumbersReadBackToTheSameValue) {
  Numbers numbers(1);
  for (int i = 0; i < 2000; ++i) {
    const double value = numbers.normal() * std::pow(10, numbers.uniform(-300, 300));
    EXPECT_EQ(parseNumber(formatNumber(value)), value);
  }
  for (double value : {0.0, -0.0, 1.0, 0.1, 5e-324, 1.7976931348623157e308})
    EXPECT_EQ(parseNumber(formatNumber(value)), value);
  EXPECT_EQ(formatNumber(0.1), "0.1");
  EXPECT_EQ(formatNumber(3), "3");
  EXPECT_EQ(formatNumber(std::numeric_limits<double>::quiet_NaN()), "nan");
  EXPECT_EQ(formatNumber(-std::numeric_limits<double>::infinity()), "-inf");
}

TEST(Text, ParseNumberTakesTheWholeText) {
  EXPECT_EQ(parseNumber("+1.5"), 1.5);
  EXPECT_EQ(parseNumber("-1e-3"), -1e-3);
  EXPECT_TRUE(std::isnan(parseNumber("nan").value()));
  for (const char* bad :
       {"", "+", "-", " 1", "1 ", "1,5", "1.5m", "0x10", "--1", "+-1", "++1", "e5"})
    EXPECT_FALSE(parseNumber(bad)) << bad;
}

TEST(Text, ParseIntegerTakesTheWholeText) {
  EXPECT_EQ(parseInteger("-9223372036854775808"), std::numeric_limits<int64_t>::min());
  for (const char* bad : {"", "1.0", "1e3", " 1", "9223372036854775808", "abc"})
    EXPECT_FALSE(parseInteger(bad)) << bad;
}

TEST(Text, FixedDecimals) {
  EXPECT_EQ(formatFixed(1.005, 1), "1.0");
  EXPECT_EQ(formatFixed(-0.25, 3), "-0.250");
  EXPECT_EQ(formatFixed(1e300, 2).size(), 304u);  // 301 digits, a point, 2 digits
}

TEST(Text, SecondsAreExactToTheMicrosecond) {
  EXPECT_EQ(formatSeconds(0), "0.000000");
  EXPECT_EQ(formatSeconds(1'403'636'579'763'555'000), "1403636579.763555");
  EXPECT_EQ(formatSeconds(-1'500'000'000), "-1.500000");
  EXPECT_EQ(formatSeconds(-100), "0.000000");
  EXPECT_EQ(formatSeconds(499), "0.000000");
  EXPECT_EQ(formatSeconds(999'999'500), "1.000000");
  EXPECT_EQ(parseSeconds("1403636579.763555"), 1'403'636'579'763'555'000);
  EXPECT_EQ(parseSeconds("0.000000001"), 1);
  EXPECT_EQ(parseSeconds("-0.5"), -500'000'000);
  EXPECT_EQ(parseSeconds("7"), 7'000'000'000);
  EXPECT_EQ(parseSeconds("1.0000000019"), 1'000'000'001);  // more digits than there are ns
  EXPECT_EQ(parseSeconds("1e-3"), 1'000'000);
  EXPECT_EQ(parseSeconds("+1.5"), 1'500'000'000);
  EXPECT_EQ(parseSeconds(".5"), 500'000'000);
  EXPECT_EQ(parseSeconds("-.5"), -500'000'000);
}

TEST(Text, SecondsThatAreNone) {
  for (const char* bad : {"", ".", "-", "1.2.3", "1.-5", "abc", "nan", "inf", "1e300",
                          "99999999999999999999", "1.5x", "1. 5", "9223372036854775807", " 1"})
    EXPECT_FALSE(parseSeconds(bad)) << bad;
}

TEST(Text, SecondsRoundTrip) {
  Numbers numbers(2);
  for (int i = 0; i < 1000; ++i) {
    const int64_t ns = 1000 * static_cast<int64_t>(numbers.uniform(-1e12, 9e14));
    EXPECT_EQ(parseSeconds(formatSeconds(ns)), ns);
  }
}

TEST(Text, Splitting) {
  EXPECT_THAT(splitBlanks("  a\tbb  c \r"), ElementsAre("a", "bb", "c"));
  EXPECT_TRUE(splitBlanks(" \t ").empty());
  EXPECT_THAT(split("a,,b,", ','), ElementsAre("a", "", "b", ""));
  EXPECT_THAT(split("", ','), ElementsAre(""));
  EXPECT_EQ(trim(" \t x y\r\n"), "x y");
  EXPECT_EQ(trim(" \n"), "");
}

TEST(Text, PosesRoundTripToTheLastDigit) {
  Numbers numbers(3);
  for (int i = 0; i < 500; ++i) {
    const SE3 pose = numbers.pose(10);
    const std::string text = formatPose(pose, ' ');
    const SE3 back = parsePose(splitBlanks(text), 0).value();
    EXPECT_EQ(formatPose(back, ' '), text);
  }
}

TEST(Text, PosesThatAreNone) {
  const auto parse = [](const char* text) { return parsePose(splitBlanks(text), 0); };
  EXPECT_TRUE(parse("1 2 3 0 0 0 1"));
  EXPECT_NEAR(parse("1 2 3 0 0 0 2")->rotation.norm(), 1, 1e-15);
  for (const char* bad : {"", "1 2 3 0 0 0", "1 2 3 0 0 0 0", "1 2 x 0 0 0 1", "nan 2 3 0 0 0 1",
                          "1 2 3 0 0 inf 1", "1 2 3 1e-9 0 0 0", "1 2 3 1e200 1e200 0 0"})
    EXPECT_FALSE(parse(bad)) << bad;
}

TEST(Text, NearestNameIsASlipAway) {
  const std::vector<std::string> names{"width", "height", "rate_hz"};
  EXPECT_EQ(nearestName("widht", names), "width");
  EXPECT_EQ(nearestName("rate", names), "rate_hz");
  EXPECT_EQ(nearestName("completely_different", {"fx", "cx"}), "");
  EXPECT_EQ(nearestName("x", {}), "");
  EXPECT_EQ(nearestName("", {}), "");
  EXPECT_EQ(didYouMean("widht", names), "; did you mean `width`?");
  EXPECT_EQ(didYouMean("x", {}), "");
}

}  // namespace
}  // namespace diorama
