#include "eval/intervals.h"

#include <gtest/gtest.h>

#include <vector>

namespace diorama {
namespace {

TEST(WilsonInterval, IsAsPublished) {
  // 81 of 263: R. Newcombe, Two-sided confidence intervals for the single proportion, 1998,
  // table 1.
  const Interval interval = wilsonInterval(81.0 / 263, 263);
  EXPECT_NEAR(interval.low, 0.2553, 5e-5);
  EXPECT_NEAR(interval.high, 0.3662, 5e-5);
  const Interval none = wilsonInterval(0, 20);  // the same table: 0 of 20
  EXPECT_NEAR(none.low, 0, 1e-12);
  EXPECT_NEAR(none.high, 0.1611, 5e-5);
}

TEST(WilsonInterval, StaysWithinShares) {
  for (double share : {0.0, 0.001, 0.5, 0.999, 1.0}) {
    const Interval interval = wilsonInterval(share, 7);
    EXPECT_GE(interval.low, 0);
    EXPECT_LE(interval.low, share + 1e-12);
    EXPECT_GE(interval.high, share - 1e-12);
    EXPECT_LE(interval.high, 1);
  }
}

TEST(BootstrapInterval, HoldsTheMeanAndIsRepeatable) {
  const std::vector<double> values = {1, 2, 3, 4, 10};
  const auto a = bootstrapInterval(values), b = bootstrapInterval(values);
  ASSERT_TRUE(a && b);
  EXPECT_DOUBLE_EQ(a->mean, 4);
  EXPECT_EQ(a->low, b->low);
  EXPECT_EQ(a->high, b->high);
  EXPECT_LT(a->low, 4);
  EXPECT_GT(a->high, 4);
  EXPECT_GE(a->low, 1);
  EXPECT_LE(a->high, 10);
}

TEST(BootstrapInterval, OneValueHasNoWidthAndNoneGivesNothing) {
  EXPECT_FALSE(bootstrapInterval({}));
  const double one[] = {3.5};
  const auto interval = bootstrapInterval(one);
  ASSERT_TRUE(interval);
  EXPECT_EQ(interval->low, 3.5);
  EXPECT_EQ(interval->high, 3.5);
}

}  // namespace
}  // namespace diorama
