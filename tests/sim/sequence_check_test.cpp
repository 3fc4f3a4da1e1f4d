#include "core/errors.h"
#include "mutator.h"
#include "tests/sim/checked_sequence.h"

namespace diorama {
namespace {

namespace fs = std::filesystem;
using test::listed;
using ::testing::Contains;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class SequenceCheckTest : public test::CheckedSequence {};

TEST_F(SequenceCheckTest, AGoodSequenceHasNoFindings) {
  const auto found = findings();
  EXPECT_THAT(found, IsEmpty()) << listed(found);
  const SequenceCheck check(sequence_);
  EXPECT_EQ(check.partCount(), 8);
  const CheckResult part = check.checkPart(3);
  for (const Check c :
       {Check::kFiles, Check::kImages, Check::kMasks, Check::kVisibility, Check::kObjects,
        Check::kDepth, Check::kPoses, Check::kFlow, Check::kNormals})
    EXPECT_GT(part.examined[static_cast<size_t>(c)], 0) << static_cast<int>(c);
}

TEST_F(SequenceCheckTest, AnyChangedByteIsNoticedByItsSum) {
  changeDepth("depth/000003.png", 20, 20, 1);
  replace("objects/known.txt", "0.050000 ", "0.050001 ");
  fs::remove(sequence_ / "id/000004.png");
  const auto found = findings();
  for (const char* file : {"depth/000003.png", "objects/known.txt", "id/000004.png"})
    EXPECT_THAT(found, Contains(Field(&CheckFinding::file, file))) << listed(found);
}

TEST_F(SequenceCheckTest, TimesMustAgree) {
  const std::vector<std::pair<std::string, std::string>> lines = {
      {"rgb.txt", "0.100000 "},
      {"depth.txt", "0.150000 "},
      {"groundtruth.txt", "0.200000 "},
      {"objects/known.txt", "0.250000 "}};
  for (const auto& [file, time] : lines) {
    SetUp();
    replace(file, "\n" + time, "\n" + std::string(time).replace(4, 1, "1"));
    const auto found = findingsWithoutManifest();
    ASSERT_FALSE(found.empty()) << file;
    EXPECT_THAT(found, Contains(Field(&CheckFinding::file, file))) << listed(found);
  }
}

TEST_F(SequenceCheckTest, WhatCannotBeReadIsAFindingAboutItsFile) {
  rewrite("rgb/000002.png", text("rgb/000002.png").substr(0, 100));
  rewrite("depth/000003.png", text("depth/000003.png").substr(0, 100));
  rewrite("instances.csv", "id,name\nx,known\n");
  std::vector<CheckFinding> found = findingsWithoutManifest();
  EXPECT_THAT(listed(found), HasSubstr("rgb/000002.png: the image is cut short"));
  EXPECT_THAT(listed(found), HasSubstr("depth/000003.png: the image is cut short"));
  EXPECT_THAT(listed(found), HasSubstr("instances.csv: 2: the id is no number"));
  rewrite("groundtruth.txt", "0.0 1 2\n");
  found = findingsWithoutManifest();
  EXPECT_THAT(found, Contains(Field(&CheckFinding::file, "groundtruth.txt"))) << listed(found);
}

// Findings, or an error of one line where nothing can be said; never a crash.
TEST_F(SequenceCheckTest, MutatedFiles) {
  const std::vector<std::string> files = {"manifest.csv",      "visibility.csv", "instances.csv",
                                          "groundtruth.txt",   "depth.txt",      "rgb.txt",
                                          "objects/known.txt", "sequence.yaml",  "odometry.csv"};
  int noticed = 0;
  constexpr uint32_t kTries = 540;
  for (uint32_t seed = 0; seed < kTries; ++seed) {
    const std::string& file = files[seed % files.size()];
    const std::string good = text(file), damaged = testing::Mutator(5000 + seed).mutate(good);
    rewrite(file, damaged);
    testing::survives(
        [&] {
          const SequenceCheck check(sequence_);
          noticed += !check.checkWhole().findings.empty();
        },
        damaged);
    rewrite(file, good);
  }
  EXPECT_GT(noticed, 100);
}

TEST_F(SequenceCheckTest, ASequenceWithoutTruthIsNotBlamedForIt) {
  for (const char* name : {"groundtruth.txt", "depth.txt", "visibility.csv", "instances.csv",
                           "objects", "depth", "id", "mask", "mask_visib", "flow", "normal"})
    fs::remove_all(sequence_ / name);
  const auto found = findingsWithoutManifest();
  EXPECT_THAT(found, IsEmpty()) << listed(found);
  fs::remove(sequence_ / "sequence.yaml");
  EXPECT_THROW(SequenceCheck{sequence_}, MissingInputError);
}

}  // namespace
}  // namespace diorama
