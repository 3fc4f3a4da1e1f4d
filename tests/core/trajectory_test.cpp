#include "core/trajectory.h"

#include <gmock/gmock.h>

#include "core/errors.h"
#include "tests/support/matchers.h"
#include "tests/support/temporary_folder.h"

namespace diorama {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)
using testing::HasSubstr;

std::string problemOf(const std::string& content) {
  TemporaryFolder folder;
  const auto file = folder.write("t.txt", content);
  return messageOf<InputError>([&] { readTum(file); });
}

Trajectory read(const std::string& content) {
  TemporaryFolder folder;
  return readTum(folder.write("t.txt", content));
}

TEST(Tum, RoundTripGivesTheSameBytes) {
  Numbers numbers(1);
  Trajectory trajectory;
  for (int i = 0; i < 200; ++i)
    trajectory.poses.push_back(
        {1'403'636'579'000'000'000 + i * int64_t{33'333'000}, numbers.pose(5)});
  const std::string text = toTum(trajectory, "# timestamp tx ty tz qx qy qz qw\n");
  const Trajectory back = read(text);
  ASSERT_EQ(back.poses.size(), trajectory.poses.size());
  for (size_t i = 0; i < back.poses.size(); ++i) {
    EXPECT_EQ(back.poses[i].timestamp_ns, trajectory.poses[i].timestamp_ns);
    EXPECT_THAT(back.poses[i].pose, PoseNear(trajectory.poses[i].pose, 0, 1e-15));
  }
  EXPECT_EQ(toTum(back, "# timestamp tx ty tz qx qy qz qw\n"), text);
}

TEST(Tum, TakesWhatPeopleWrite) {
  const Trajectory trajectory = read(
      "# a comment\r\n\r\n  1.5\t1 2 3  0 0 0 2 \r\n#\n2.5 1 2 3 0 0 0 -1\n"
      "1e1 1e-3 +2 3 0 0 1 0");
  ASSERT_EQ(trajectory.poses.size(), 3u);
  EXPECT_EQ(trajectory.poses[0].timestamp_ns, 1'500'000'000);
  EXPECT_EQ(trajectory.poses[0].pose.rotation.w(), 1);
  EXPECT_EQ(trajectory.poses[2].timestamp_ns, 10'000'000'000);
}

TEST(Tum, EmptyFilesAreEmptyTrajectories) {
  EXPECT_TRUE(read("").poses.empty());
  EXPECT_TRUE(read("# nothing\n\n").poses.empty());
}

TEST(Tum, ErrorsNameFileAndLine) {
  EXPECT_THAT(problemOf("# c\n1 0 0 0 0 0 0 1\n2 0 0 0 0 0\n"), HasSubstr("t.txt:3: 6 fields"));
  EXPECT_THAT(problemOf("1 0 0 0 0 0 0 1 9\n"), HasSubstr("t.txt:1: 9 fields"));
  EXPECT_THAT(problemOf("now 0 0 0 0 0 0 1\n"), HasSubstr("t.txt:1: the time stamp"));
  EXPECT_THAT(problemOf("nan 0 0 0 0 0 0 1\n"), HasSubstr("the time stamp"));
  EXPECT_THAT(problemOf("1 0 0 zero 0 0 0 1\n"), HasSubstr("t.txt:1: the pose"));
  EXPECT_THAT(problemOf("1 nan 0 0 0 0 0 1\n"), HasSubstr("the pose is not finite"));
  EXPECT_THAT(problemOf("1 inf 0 0 0 0 0 1\n"), HasSubstr("the pose is not finite"));
  EXPECT_THAT(problemOf("1 0 0 0 0 0 0 0\n"), HasSubstr("quaternion is zero"));
  EXPECT_THAT(problemOf("2 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n"),
              HasSubstr("t.txt:2: the time stamps"));
  EXPECT_THAT(problemOf("2 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n"), HasSubstr("must increase"));
  EXPECT_NE(problemOf(std::string("\x7f"
                                  "ELF\0\1\2\xff\n\0\0",
                                  10)),
            "");
  EXPECT_NE(problemOf(std::string(1 << 20, 'x')), "");
  for (const std::string& text : {problemOf("1 2"), problemOf("a b c d e f g h")})
    EXPECT_EQ(text.find('\n'), std::string::npos) << "one line";
}

TEST(Tum, MissingFilesAreMissingInput) {
  TemporaryFolder folder;
  EXPECT_THROW(readTum(folder.path() / "none.txt"), MissingInputError);
  EXPECT_THROW(readTum(folder.path()), MissingInputError);
}

TEST(Trajectory, NearestInTime) {
  Trajectory t;
  t.poses = {{100, {}}, {200, {}}, {300, {}}};
  EXPECT_EQ(t.nearest(149, 100)->timestamp_ns, 100);
  EXPECT_EQ(t.nearest(150, 100)->timestamp_ns, 100);  // the earlier of two
  EXPECT_EQ(t.nearest(151, 100)->timestamp_ns, 200);
  EXPECT_EQ(t.nearest(200, 0)->timestamp_ns, 200);
  EXPECT_EQ(t.nearest(310, 10)->timestamp_ns, 300);
  EXPECT_EQ(t.nearest(311, 10), nullptr);
  EXPECT_EQ(t.nearest(89, 10), nullptr);
  EXPECT_EQ(Trajectory{}.nearest(0, 100), nullptr);
}

}  // namespace
}  // namespace diorama
