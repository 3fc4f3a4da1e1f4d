#include "eval/table.h"

#include <gmock/gmock.h>

#include <limits>

namespace diorama {
namespace {

TEST(Table, AlignsColumns) {
  EXPECT_EQ(formatTable({{"name", "a °", "b"}, {{"x", "1.00", "–"}, {"longer", "12.00"}}}),
            "name      a °  b\n"
            "────────────────\n"
            "x        1.00  –\n"
            "longer  12.00\n");
  EXPECT_EQ(formatTable({}), "\n\n");
}

TEST(Table, CellsOfUnknownNumbersAreDashes) {
  EXPECT_EQ(formatCell(0.0123, 1, 1e3), "12.3");
  EXPECT_EQ(formatCell(std::nullopt, 2), "–");
  EXPECT_EQ(formatCell(std::numeric_limits<double>::quiet_NaN(), 2), "–");
}

TEST(Metrics, ListHoldsEveryNumberUnderItsPath) {
  Metrics metrics;
  metrics.camera.ate_mean_m = 0.25;
  metrics.objects.push_back({"cube", {}});
  metrics.objects[0].metrics.reinitialisations = 3;
  const auto find = [&](const std::string& path) -> std::optional<MetricValue> {
    for (const MetricValue& value : listMetrics(metrics))
      if (value.path == path) return value;
    return std::nullopt;
  };
  EXPECT_EQ(find("camera.ate_mean_m")->value, 0.25);
  EXPECT_EQ(find("objects.cube.reinitialisations")->value, 3);
  ASSERT_TRUE(find("objects.cube.map_nees"));
  EXPECT_FALSE(find("objects.cube.map_nees")->value);
  EXPECT_TRUE(find("timing.dropped_frames"));
  EXPECT_TRUE(find("peak_memory_mb"));
  EXPECT_EQ(listMetrics(metrics).size(), 3u + 9 + 18 + 7 + 1);
}

TEST(Metrics, TablesNameTheObjects) {
  Metrics metrics;
  metrics.objects.push_back({"carton", {}});
  metrics.objects[0].metrics.mean_error_m = 0.00123;
  const std::string text = formatMetrics(metrics);
  EXPECT_THAT(text, testing::HasSubstr("carton"));
  EXPECT_THAT(text, testing::HasSubstr("1.23"));
  EXPECT_THAT(text, testing::HasSubstr("ATE mean mm"));
}

}  // namespace
}  // namespace diorama
