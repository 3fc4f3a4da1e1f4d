#include "eval/statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace diorama {
namespace {

TEST(Statistics, OfAnEvenNumberOfValues) {
  const std::vector<double> values{4, 1, 3, 2};
  const Statistics s = summarise(values).value();
  EXPECT_EQ(s.count, 4u);
  EXPECT_NEAR(s.mean, 2.5, 1e-12);
  EXPECT_NEAR(s.std, std::sqrt(1.25), 1e-12);  // of the population
  EXPECT_NEAR(s.median, 2.5, 1e-12);
  EXPECT_NEAR(s.rmse, std::sqrt(7.5), 1e-12);
  EXPECT_EQ(s.min, 1);
  EXPECT_EQ(s.max, 4);
}

TEST(Statistics, OfAnOddNumberOfValues) {
  const std::vector<double> values{9, 0, 3};
  EXPECT_EQ(summarise(values)->median, 3);
}

TEST(Statistics, OfOneValueAndOfNone) {
  const std::vector<double> one{0.25};
  const Statistics s = summarise(one).value();
  EXPECT_EQ(s.mean, 0.25);
  EXPECT_EQ(s.std, 0);
  EXPECT_EQ(s.median, 0.25);
  EXPECT_EQ(s.rmse, 0.25);
  EXPECT_FALSE(summarise({}));
}

TEST(Statistics, StandardDeviationOfEqualLargeValuesIsZero) {
  const std::vector<double> values(1000, 1e8 + 0.1);
  EXPECT_LT(summarise(values)->std, 1e-5);
}

}  // namespace
}  // namespace diorama
