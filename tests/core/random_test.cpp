#include "core/random.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

namespace diorama {
namespace {

TEST(Random, KnownAnswers) {
  // Philox 4x32-10 of counter 0 and key 0, from Random123's table of known answers.
  r123::Philox4x32::ctr_type counter{{0, 0, 0, 0}};
  r123::Philox4x32::key_type key{{0, 0}};
  const auto out = r123::Philox4x32()(counter, key);
  EXPECT_EQ(out[0], 0x6627e8d5u);
  EXPECT_EQ(out[1], 0xe169c58du);
  EXPECT_EQ(out[2], 0xbc57ac4cu);
  EXPECT_EQ(out[3], 0x9b00dbd8u);
}

TEST(Random, IsAFunctionOfItsArguments) {
  const Random a(7, RandomStream::kTest), b(7, RandomStream::kTest);
  // In another order.
  std::array<std::array<uint32_t, 4>, 100> forwards{};
  for (uint64_t i = 0; i < 100; ++i) forwards[i] = a.bits(3, i);
  for (uint64_t i = 100; i-- > 0;) EXPECT_EQ(b.bits(3, i), forwards[i]);
}

TEST(Random, EveryArgumentMatters) {
  const uint64_t big = uint64_t{1} << 40;
  std::set<std::array<uint32_t, 4>> all;
  for (uint64_t seed : {uint64_t{0}, uint64_t{1}, big})
    for (RandomStream stream : {RandomStream::kSensorNoise, RandomStream::kTest})
      for (uint32_t frame : {0u, 1u, 900u})
        for (uint64_t index : {uint64_t{0}, uint64_t{1}, big})
          all.insert(Random(seed, stream).bits(frame, index));
  EXPECT_EQ(all.size(), 3u * 2 * 3 * 3);
}

TEST(Random, EightAtOnceAreTheSame) {
  const Random random(0x123456789abcdefull, RandomStream::kTest);
  for (const uint64_t first : {uint64_t{0}, uint64_t{8}, uint64_t{0xfffffffcu}}) {
    const auto eight = random.bitsOfEight(17, first);
    for (size_t k = 0; k < 8; ++k)
      for (size_t word = 0; word < 4; ++word)
        EXPECT_EQ(eight[word][k], random.bits(17, first + k)[word]) << first << ' ' << k;
  }
}

TEST(Random, UniformMoments) {
  const Random random(1, RandomStream::kTest);
  double sum = 0, squares = 0;
  constexpr int n = 50000;
  for (uint64_t i = 0; i < n; ++i) {
    for (double u : random.uniform(0, i)) {
      ASSERT_GT(u, 0);
      ASSERT_LT(u, 1);
      sum += u;
      squares += u * u;
    }
  }
  const double count = 4.0 * n;
  EXPECT_NEAR(sum / count, 0.5, 4 * std::sqrt(1.0 / 12 / count));
  EXPECT_NEAR(squares / count, 1.0 / 3, 4 * std::sqrt(4.0 / 45 / count));
}

TEST(Random, NormalMoments) {
  const Random random(2, RandomStream::kTest);
  double moments[5] = {}, cross = 0;
  constexpr int n = 50000;
  for (uint64_t i = 0; i < n; ++i) {
    const auto v = random.normal(5, i);
    for (double x : v) {
      ASSERT_TRUE(std::isfinite(x));
      for (int k = 1; k < 5; ++k) moments[k] += std::pow(x, k) / (4.0 * n);
    }
    cross += (v[0] * v[1] + v[1] * v[2] + v[2] * v[3]) / (3.0 * n);
  }
  const double root = 1 / std::sqrt(4.0 * n);
  EXPECT_NEAR(moments[1], 0, 4 * root);
  EXPECT_NEAR(moments[2], 1, 4 * std::sqrt(2.0) * root);
  EXPECT_NEAR(moments[3], 0, 4 * std::sqrt(15.0) * root);
  EXPECT_NEAR(moments[4], 3, 4 * std::sqrt(96.0) * root);
  EXPECT_NEAR(cross, 0, 4 / std::sqrt(3.0 * n));
}

}  // namespace
}  // namespace diorama
