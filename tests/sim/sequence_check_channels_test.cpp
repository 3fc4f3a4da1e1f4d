#include "tests/sim/checked_sequence.h"

namespace diorama {
namespace {

using test::listed;
using ::testing::HasSubstr;

class SequenceCheckChannels : public test::CheckedSequence {};

TEST_F(SequenceCheckChannels, MasksMustBeThoseOfTheIdsAndOfTheMesh) {
  Image<uint8_t> visible = image<uint8_t>("mask_visib/000001_000000.png");
  const auto shown = std::find(visible.pixels.begin(), visible.pixels.end(), 255);
  *shown = 0;
  rewrite("mask_visib/000001_000000.png", encodePng(visible, PngContent::kLabels));
  Image<uint8_t> whole = image<uint8_t>("mask/000002_000000.png");
  whole(3, 4) = 255;
  rewrite("mask/000002_000000.png", encodePng(whole, PngContent::kLabels));
  whole(3, 4) = 7;
  rewrite("mask/000003_000000.png", encodePng(whole, PngContent::kLabels));
  Image<uint16_t> ids = image<uint16_t>("id/000005.png");
  ids(0, 0) = 9;
  rewrite("id/000005.png", encodePng(ids));
  const auto found = findingsWithoutManifest();
  EXPECT_THAT(listed(found), HasSubstr("mask_visib/000001_000000.png: is not what the ids say"));
  EXPECT_THAT(listed(found), HasSubstr("mask_visib/000001_000000.png: has "));
  EXPECT_THAT(listed(found), HasSubstr("mask/000002_000000.png: has "));
  EXPECT_THAT(
      listed(found),
      HasSubstr("mask/000002_000000.png: is not the silhouette of the mesh, at pixel (3, 4)"));
  EXPECT_THAT(listed(found), HasSubstr("mask/000003_000000.png: has the value 7"));
  EXPECT_THAT(listed(found), HasSubstr("id/000005.png: has an id that is not in instances.csv"));
}

TEST_F(SequenceCheckChannels, FlowMustBeThatOfDepthAndPoses) {
  Image<Rgb16> flow = readWideColor(sequence_ / "flow/000002_000003.png", 160, 120);
  ASSERT_EQ(flow(80, 100).b, 1);
  flow(80, 100).r = static_cast<uint16_t>(flow(80, 100).r + 20);  // 0.3 px
  rewrite("flow/000002_000003.png", encodePng(flow));
  flow = readWideColor(sequence_ / "flow/000003_000004.png", 160, 120);
  Image<uint16_t> ids = image<uint16_t>("id/000003.png");
  const auto known =
      static_cast<size_t>(std::find(ids.pixels.begin(), ids.pixels.end(), 1) - ids.pixels.begin());
  ASSERT_EQ(flow.pixels[known].b, 1);
  flow.pixels[known].r = static_cast<uint16_t>(flow.pixels[known].r + 5);  // 0.08 px
  rewrite("flow/000003_000004.png", encodePng(flow));
  // All of a known object: it has poses, and does not move by itself.
  flow = readWideColor(sequence_ / "flow/000004_000005.png", 160, 120);
  ids = image<uint16_t>("id/000004.png");
  for (size_t i = 0; i < ids.pixels.size(); ++i)
    if (ids.pixels[i] == 1) flow.pixels[i].g = static_cast<uint16_t>(flow.pixels[i].g + 64);
  rewrite("flow/000004_000005.png", encodePng(flow));
  writeFileAtomically(sequence_ / "flow/000004_000009.png", text("flow/000004_000005.png"));
  const auto found = findingsWithoutManifest();
  EXPECT_THAT(listed(found), HasSubstr("flow/000002_000003.png: is not what depth and poses make "
                                       "of it at pixel (80, 100) and at 0 more"));
  EXPECT_THAT(listed(found), HasSubstr("flow/000003_000004.png: is not what depth and poses make "
                                       "of it at pixel (" +
                                       std::to_string(known % 160) + ", " +
                                       std::to_string(known / 160) + ") and at 0 more"));
  EXPECT_THAT(listed(found), HasSubstr("flow/000004_000005.png: is not what depth"));
  EXPECT_THAT(listed(found),
              HasSubstr("flow/000004_000009.png: is between frames that are not there"));
  EXPECT_EQ(found.size(), 4) << listed(found);
}

// A few of its pixels move by more than files resolve.
TEST_F(SequenceCheckChannels, FlowOfWhatTurnsSlowlyByItselfIsNoError) {
  const std::string file = "flow/000004_000005.png";
  Image<Rgb16> flow = readWideColor(sequence_ / file, 160, 120);
  const Image<uint16_t> ids = image<uint16_t>("id/000004.png");
  int moved = 0;
  for (size_t i = 0; i < ids.pixels.size() && moved < 20; ++i)
    if (ids.pixels[i] == 2) {                                          // untracked
      flow.pixels[i].r = static_cast<uint16_t>(flow.pixels[i].r + 8);  // 0.125 px
      ++moved;
    }
  ASSERT_EQ(moved, 20);
  rewrite(file, encodePng(flow));
  EXPECT_THAT(findingsWithoutManifest(), ::testing::IsEmpty());
}

TEST_F(SequenceCheckChannels, NormalsMustBeThoseOfThePlanesInTheDepth) {
  Image<Rgb8> normal = image<Rgb8>("normal/000004.png");
  for (int y = 100; y < 104; ++y)  // the floor
    for (int x = 80; x < 84; ++x) normal(x, y) = {128, 128, 0};
  rewrite("normal/000004.png", encodePng(normal));
  normal = image<Rgb8>("normal/000005.png");
  normal(20, 30) = {128, 128, 255};
  normal(21, 30) = {128, 128, 30};
  rewrite("normal/000005.png", encodePng(normal));
  std::filesystem::remove(sequence_ / "normal/000006.png");
  const auto found = findingsWithoutManifest();
  EXPECT_THAT(listed(found), HasSubstr("normal/000004.png: is not along the depth's planes at "
                                       "pixel (81, 100) and at "));
  EXPECT_THAT(listed(found), HasSubstr("normal/000005.png: is no unit vector towards the camera "
                                       "at pixel (20, 30) and at 1 more"));
  EXPECT_THAT(listed(found), HasSubstr("normal/000006.png: is not there"));
  EXPECT_EQ(found.size(), 3) << listed(found);
}

TEST_F(SequenceCheckChannels, VisibilityMustBeThatOfThePixels) {
  const std::string rows = text("visibility.csv");
  const size_t row = rows.find("\n4,known,") + 1, end = rows.find('\n', row);
  rewrite("visibility.csv", std::string(rows).erase(row, end - row + 1));
  EXPECT_THAT(listed(findingsWithoutManifest()),
              HasSubstr("visibility.csv: has no row for known in frame 4"));
  rewrite("visibility.csv", std::string(rows).insert(rows.rfind(',', end) + 1, "1"));
  EXPECT_THAT(listed(findingsWithoutManifest()),
              HasSubstr("the fraction is not that of the counts"));
}

}  // namespace
}  // namespace diorama
