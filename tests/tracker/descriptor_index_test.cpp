#include "tracker/descriptor_index.h"

#include <gmock/gmock.h>

#include "core/random.h"

namespace diorama {
namespace {

constexpr int kSize = 64;

// Like those of views of a few hundred places: scattered around as many centres.
std::vector<uint8_t> descriptors(int count, uint32_t set) {
  const Random random(1, RandomStream::kTest);
  std::vector<uint8_t> bytes;
  for (int k = 0; k < count; ++k)
    for (int i = 0; i < kSize; i += 4) {
      const auto centre = random.uniform(0, static_cast<uint64_t>(1000 * (k % 300) + i));
      const auto noise = random.normal(set, static_cast<uint64_t>(1000 * k + i));
      for (size_t c = 0; c < 4; ++c)
        bytes.push_back(
            static_cast<uint8_t>(std::clamp(200 * centre[c] + 10 * noise[c], 0., 255.)));
    }
  return bytes;
}

int squareOf(const uint8_t* a, const uint8_t* b) {
  int sum = 0;
  for (int i = 0; i < kSize; ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return sum;
}

TEST(DescriptorIndex, FindsWhatLookingAtAllFinds) {
  const std::vector<uint8_t> all = descriptors(5000, 1), queries = descriptors(200, 2);
  const DescriptorIndex index(all, kSize);
  int same = 0;
  for (size_t q = 0; q < 200; ++q) {
    const uint8_t* const query = queries.data() + q * kSize;
    int least = 1 << 30;
    for (size_t k = 0; k < 5000; ++k) least = std::min(least, squareOf(query, &all[k * kSize]));
    const DescriptorIndex::Neighbours found = index.find(query);
    for (size_t k = 0; k + 1 < found.size(); ++k) EXPECT_LE(found[k].square, found[k + 1].square);
    for (const DescriptorIndex::Neighbour& n : found)
      EXPECT_EQ(n.square, squareOf(query, &all[static_cast<size_t>(n.index) * kSize]));
    same += found[0].square == least;
  }
  EXPECT_GE(same, 196);
}

TEST(DescriptorIndex, FewOrNone) {
  const std::vector<uint8_t> three = descriptors(3, 1);
  EXPECT_EQ(DescriptorIndex({}, kSize).find(three.data())[0].index, -1);
  const DescriptorIndex::Neighbours found = DescriptorIndex(three, kSize).find(&three[kSize]);
  EXPECT_EQ(found[0].index, 1);
  EXPECT_EQ(found[0].square, 0);
  EXPECT_GE(found[2].index, 0);
  EXPECT_EQ(found[3].index, -1);
  const std::vector<uint8_t> alike(1000 * kSize, 7);
  EXPECT_EQ(DescriptorIndex(alike, kSize).find(alike.data())[7].square, 0);
}

}  // namespace
}  // namespace diorama
