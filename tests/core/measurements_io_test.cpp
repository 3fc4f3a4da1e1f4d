#include "core/measurements_io.h"

#include <gmock/gmock.h>

#include "core/errors.h"
#include "core/text.h"
#include "tests/support/matchers.h"
#include "tests/support/temporary_folder.h"

namespace diorama {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)
using testing::HasSubstr;

Matrix6d symmetric(Numbers& numbers) {
  Matrix6d m;
  for (int i = 0; i < 6; ++i) m.col(i) = numbers.normal6();
  return m * m.transpose();
}

OdometryMeasurement odometry(Numbers& numbers) {
  return {"simulated",
          100,
          33'433'333,
          numbers.pose(1),
          symmetric(numbers),
          numbers.uniform(0, 1),
          numbers.uniform(0, 1) < 0.5};
}

ObjectMeasurement object(Numbers& numbers) {
  return {"edge", "carton", 33'433'333, numbers.pose(1), symmetric(numbers), numbers.uniform(0, 1),
          true,   ""};
}

TEST(Measurements, RoundTripToTheLastDigit) {
  Numbers numbers(1);
  std::string text = measurementsHeader();
  for (int i = 0; i < 50; ++i) text += toCsv(odometry(numbers)) + toCsv(object(numbers));
  TemporaryFolder folder;
  const Measurements back = readMeasurements(folder.write("m.csv", text));
  ASSERT_EQ(back.odometry.size(), 50u);
  ASSERT_EQ(back.objects.size(), 50u);
  std::string again = measurementsHeader();
  for (size_t i = 0; i < 50; ++i) again += toCsv(back.odometry[i]) + toCsv(back.objects[i]);
  EXPECT_EQ(again, text);
  EXPECT_EQ(back.odometry[0].from_ns, 100);
  EXPECT_EQ(back.objects[0].object, "carton");
  EXPECT_TRUE(back.objects[0].claimed);
  EXPECT_EQ(Matrix6d(back.objects[0].covariance.transpose()), back.objects[0].covariance);
}

TEST(Measurements, OdometryUpToScaleIsNamed) {
  OdometryMeasurement m;
  m.source = "vo";
  m.to_ns = 5;
  m.T_from_to = {expSO3({0, 0.3, 0}), {0.2, 0, 0.1}};
  m.covariance *= 1e-6;
  EXPECT_THAT(toCsv(m), HasSubstr(",odometry,camera,"));
  EXPECT_EQ(m.covarianceWithScale(), m.covariance);
  m.up_to_scale = true;
  TemporaryFolder folder;
  const auto file = folder.write("m.csv", measurementsHeader() + toCsv(m));
  EXPECT_TRUE(readMeasurements(file).odometry[0].up_to_scale);
  // Twice as long is one sigma off, and half a step aside is far off.
  SE3 longer = m.T_from_to, aside = m.T_from_to;
  longer.translation *= 2;
  aside.translation.y() += 0.1;
  const auto squaredDistance = [&](const SE3& T) {
    const Vector6d e = log(m.T_from_to.inverse() * T);
    return e.dot(m.covarianceWithScale().llt().solve(e));
  };
  EXPECT_NEAR(squaredDistance(longer), 1, 1e-3);
  EXPECT_GT(squaredDistance(aside), 1e3);
}

TEST(Measurements, HeaderHasTheColumnsOfTheContract) {
  const std::string header = measurementsHeader();
  EXPECT_THAT(header, testing::StartsWith("timestamp_ns,source,kind,name,from_ns,tx,ty,tz,qx,qy,qz,"
                                          "qw,health,c00,c01"));
  EXPECT_THAT(header, testing::EndsWith("c44,c45,c55\n"));
  EXPECT_EQ(split(trim(header), ',').size(), 34u);
}

// One field of a good line replaced.
std::string problemOf(size_t field, const std::string& value, bool of_odometry = true) {
  Numbers numbers(2);
  const std::string line = of_odometry ? toCsv(odometry(numbers)) : toCsv(object(numbers));
  std::string changed;
  size_t number = 0;
  for (std::string_view cell : split(trim(line), ','))
    changed += (number ? "," : "") + (number == field ? value : std::string(cell)), ++number;
  TemporaryFolder folder;
  const auto file = folder.write("m.csv", measurementsHeader() + changed + "\n");
  return messageOf<InputError>([&] { readMeasurements(file); });
}

TEST(Measurements, HostileLinesNameTheLine) {
  EXPECT_EQ(problemOf(99, ""), "");
  EXPECT_THAT(problemOf(0, "1.5"), HasSubstr("m.csv:2: timestamp_ns"));
  EXPECT_THAT(problemOf(0, ""), HasSubstr("timestamp_ns"));
  EXPECT_THAT(problemOf(2, "imu"), HasSubstr("unknown kind `imu`"));
  EXPECT_THAT(problemOf(4, "33433333"), HasSubstr("from_ns"));
  EXPECT_THAT(problemOf(4, ""), HasSubstr("from_ns"));
  EXPECT_THAT(problemOf(5, "nan"), HasSubstr("pose"));
  EXPECT_THAT(problemOf(11, "x"), HasSubstr("pose"));
  EXPECT_THAT(problemOf(12, "1.01"), HasSubstr("health"));
  EXPECT_THAT(problemOf(12, "nan"), HasSubstr("health"));
  EXPECT_THAT(problemOf(13, "inf"), HasSubstr("covariance"));
  EXPECT_THAT(problemOf(33, ""), HasSubstr("covariance"));
  EXPECT_THAT(problemOf(1, "a,b"), HasSubstr("35 columns instead of 34"));
  EXPECT_THAT(problemOf(4, "rubbish", false), "");  // objects have no from_ns
}

TEST(Measurements, EmptyAndMissingFiles) {
  TemporaryFolder folder;
  EXPECT_TRUE(readMeasurements(folder.write("e.csv", "")).odometry.empty());
  EXPECT_TRUE(
      readMeasurements(folder.write("h.csv", measurementsHeader() + "\r\n")).objects.empty());
  EXPECT_THROW(readMeasurements(folder.path() / "none.csv"), MissingInputError);
  EXPECT_THROW(readMeasurements(folder.write("b.csv", std::string("\0\xff\n", 3))), InputError);
}

}  // namespace
}  // namespace diorama
