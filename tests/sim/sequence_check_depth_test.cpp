#include <numbers>

#include "sim/sequence_check_depth.h"
#include "tests/sim/checked_sequence.h"

namespace diorama {
namespace {

namespace fs = std::filesystem;
using test::listed;
using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class SequenceCheckDepth : public test::CheckedSequence {};

// Every place that has a surface: walls, floor, the other box and the known one.
TEST_F(SequenceCheckDepth, OnePixelOfDepthThatIsTwentyMillimetresOff) {
  const std::string file = "depth/000004.png", good = text(file);
  fs::remove(sequence_ / "manifest.csv");
  int tried = 0, found = 0;
  for (int y = 7; y < 120; y += 35)
    for (int x = 9; x < 160; x += 29) {
      rewrite(file, good);
      changeDepth(file, x, y, tried % 2 ? 100 : -100);
      ++tried;
      const SequenceCheck check(sequence_);
      const std::vector<CheckFinding> findings = check.checkPart(4).findings;
      found += std::any_of(findings.begin(), findings.end(), [&](const CheckFinding& f) {
        return f.file == file && f.what.find("(" + std::to_string(x) + ", " + std::to_string(y) +
                                             ")") != std::string::npos;
      });
    }
  EXPECT_EQ(tried, 24);
  EXPECT_GE(found, 23);
}

TEST_F(SequenceCheckDepth, APoseOfTheCameraThatIsFiveMillimetresOrHalfADegreeOff) {
  fs::remove(sequence_ / "manifest.csv");
  fs::remove(sequence_ / "odometry.csv");  // its noise alone would tell
  replace("sequence.yaml", "odometry: odometry.csv\n", "");
  const std::string good = text("groundtruth.txt");
  for (size_t line : {0u, 4u, 7u})
    for (int axis = 0; axis < 6; ++axis) {
      rewrite("groundtruth.txt", good);
      movePose("groundtruth.txt", line,
               Vector6d::Unit(axis) * (axis < 3 ? 0.005 : 0.5 * std::numbers::pi / 180));
      const auto found = findings();
      EXPECT_THAT(found, Contains(Field(&CheckFinding::file, "groundtruth.txt")))
          << line << " " << axis;
      EXPECT_THAT(found, Not(Contains(Field(&CheckFinding::file, HasSubstr("objects/")))));
    }
}

TEST_F(SequenceCheckDepth, APoseOfAnObjectThatIsFiveMillimetresOrHalfADegreeOff) {
  fs::remove(sequence_ / "manifest.csv");
  const std::string good = text("objects/known.txt");
  for (int axis = 0; axis < 6; ++axis) {
    rewrite("objects/known.txt", good);
    movePose("objects/known.txt", 2,
             Vector6d::Unit(axis) * (axis < 3 ? 0.005 : 0.5 * std::numbers::pi / 180));
    const SequenceCheck check(sequence_);
    const auto found = check.checkPart(2).findings;
    ASSERT_FALSE(found.empty()) << axis;
    for (const CheckFinding& f : found) EXPECT_EQ(f.file, "objects/known.txt") << f.what;
    EXPECT_THAT(check.checkPart(1).findings, IsEmpty()) << "its flow leads to the wrong pose";
    EXPECT_THAT(check.checkPart(3).findings, IsEmpty());
    EXPECT_THAT(check.checkWhole().findings,
                Contains(Field(&CheckFinding::what, HasSubstr("rest"))));
  }
}

// A wall at 3 m of one instance and a box before it whose side, 5 px from the left, is as narrow as
// a pixel.
DepthView wallAndBox() {
  DepthView view{SE3{}, {}, Image<float>(16, 12), Image<uint16_t>(16, 12)};
  for (int y = 0; y < 12; ++y)
    for (int x = 0; x < 16; ++x) view.depth_m(x, y) = x < 5 ? 3.0f : x == 5 ? 2.75f : 2.5f;
  return view;
}

TEST(DepthComparison, WhatMayBeSeenOnASideThatIsAsNarrowAsAPixel) {
  const DepthComparison comparison(Camera({CameraModel::kPinhole, 16, 12, 130, 130, 7.5, 5.5, {}}));
  const DepthView other = wallAndBox();
  const auto mayShow = [&](int x, float depth_m, uint16_t id = 0) {
    DepthView view = wallAndBox();
    view.depth_m(x, 6) = depth_m;
    view.ids(x, 6) = id;
    return comparison.mayShow(view, {x, 6}, other);
  };
  for (float depth : {2.6f, 2.75f, 2.9f}) EXPECT_TRUE(mayShow(5, depth)) << depth;
  EXPECT_FALSE(mayShow(5, 2.4f)) << "before the box";
  EXPECT_FALSE(mayShow(5, 3.1f)) << "behind the wall";
  EXPECT_FALSE(mayShow(5, 2.75f, 1)) << "another instance";
  EXPECT_TRUE(mayShow(2, 3.002f));
  EXPECT_FALSE(mayShow(2, 2.98f)) << "off a plane";
  EXPECT_FALSE(mayShow(10, 2.52f)) << "off a plane";
}

// Where depth changes by more than the error from pixel to pixel, the plane still tells.
TEST(DepthComparison, WhatIsOffASlantedPlane) {
  const Camera camera({CameraModel::kPinhole, 16, 12, 130, 130, 7.5, 5.5, {}});
  const DepthComparison comparison(camera);
  DepthView floor{SE3{}, {}, Image<float>(16, 12), Image<uint16_t>(16, 12)};
  for (int y = 0; y < 12; ++y)  // 0.4 m below, seen at some 10 degrees
    for (int x = 0; x < 16; ++x)
      floor.depth_m(x, y) = static_cast<float>(0.4 / (0.18 + (y - 5.5) / 130));
  DepthView view = floor;
  EXPECT_GT(floor.depth_m(8, 5) - floor.depth_m(8, 6), 0.05f);
  EXPECT_TRUE(comparison.mayShow(view, {8, 6}, floor));
  view.depth_m(8, 6) += 0.02f;
  EXPECT_FALSE(comparison.mayShow(view, {8, 6}, floor));
}

}  // namespace
}  // namespace diorama
