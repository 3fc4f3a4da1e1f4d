#include "sim/y4m_writer.h"

#include <gtest/gtest.h>

namespace diorama {
namespace {

TEST(Y4m, HeaderTellsSizeRateAndRange) {
  EXPECT_EQ(y4mHeader(640, 480, 30), "YUV4MPEG2 W640 H480 F30:1 Ip A1:1 C444 XCOLORRANGE=FULL\n");
  EXPECT_EQ(y4mHeader(8, 6, 29.97).substr(0, 29), "YUV4MPEG2 W8 H6 F2997:100 Ip ");
}

TEST(Y4m, FramesAreFullRangePlanes) {
  Image<Rgb8> image(5, 1);
  image.pixels = {{0, 0, 0}, {255, 255, 255}, {90, 90, 90}, {255, 0, 0}, {0, 0, 255}};
  const std::string frame = y4mFrame(image);
  ASSERT_EQ(frame.size(), 6u + 15);
  EXPECT_EQ(frame.substr(0, 6), "FRAME\n");
  const auto byte = [&](size_t i) { return static_cast<int>(static_cast<uint8_t>(frame[6 + i])); };
  for (auto [i, grey] : {std::pair{0u, 0}, {1u, 255}, {2u, 90}}) {
    EXPECT_EQ(byte(i), grey);
    EXPECT_EQ(byte(5 + i), 128);
    EXPECT_EQ(byte(10 + i), 128);
  }
  EXPECT_EQ(byte(3), 76);        // 0.299 * 255
  EXPECT_EQ(byte(5 + 3), 85);    // 128 - 0.168736 * 255
  EXPECT_EQ(byte(10 + 3), 255);  // 255.5, clamped
  EXPECT_EQ(byte(4), 29);
  EXPECT_EQ(byte(5 + 4), 255);
  EXPECT_EQ(byte(10 + 4), 107);
}

}  // namespace
}  // namespace diorama
