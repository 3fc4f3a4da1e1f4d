#include "app/sweep_spec.h"

#include <gmock/gmock.h>

#include "app/sweep_table.h"
#include "core/errors.h"
#include "tests/support/temporary_folder.h"

namespace diorama {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kSpec = R"(
scene: /nowhere/desk.yaml
frames: 0:10
set: {effects.blur: false}
seeds: [4, 5]
factors:
  - {name: level, path: occlude.0.visible_fraction, template: "[[0, 1], [1, {}], [9, {}]]", values: [1, 0.5]}
  - {name: size, cases: {small: {tracker.max_samples: 50}, large: {tracker.max_samples: 500, scene: /nowhere/other.yaml}}}
  - {name: method, values: [ebt, fused]}
thresholds:
  - {metric: success_5cm_5deg, at_least: 0.9, where: {method: fused, level: {at_least: 0.5}, size: [small]}}
)";

class SweepSpecTest : public testing::Test {
 protected:
  SweepSpec read(const std::string& text) { return readSweepSpec(folder_.write("s.yaml", text)); }
  std::string messageFor(const std::string& text) {
    return test::messageOf<InputError>([&] { read(text); });
  }
  test::TemporaryFolder folder_;
};

TEST_F(SweepSpecTest, CellsAreTheGridInOrder) {
  const SweepSpec spec = read(kSpec);
  const std::vector<SweepCell> cells = sweepCells(spec);
  ASSERT_EQ(cells.size(), 16u);
  EXPECT_EQ(cells[0].at, (std::vector<size_t>{0, 0, 0}));
  EXPECT_EQ(cells[0].seed, 4u);
  EXPECT_EQ(cells[1].seed, 5u);
  EXPECT_EQ(cells[2].at, (std::vector<size_t>{0, 0, 1}));
  EXPECT_EQ(cells[15].at, (std::vector<size_t>{1, 1, 1}));
  EXPECT_EQ(cells[0].scene, "/nowhere/desk.yaml");
  EXPECT_EQ(cells[4].scene, "/nowhere/other.yaml");
  EXPECT_THAT(cells[8].options, Contains("occlude.0.visible_fraction=[[0, 1], [1, 0.5], [9, 0.5]]"));
  EXPECT_THAT(cells[0].options, Contains("tracker.max_samples=50"));
  EXPECT_THAT(cells[0].options, Contains("effects.blur=false"));
}

TEST_F(SweepSpecTest, PicturesDoNotDependOnEstimators) {
  const std::vector<SweepCell> cells = sweepCells(read(kSpec));
  EXPECT_EQ(cells[0].render, cells[2].render);  // another method
  EXPECT_THAT(cells[0].render, Not(Contains("tracker.max_samples=50")));
  EXPECT_NE(cells[0].render, cells[1].render);  // another seed
  EXPECT_NE(cells[0].render, cells[8].render);  // another level
}

TEST_F(SweepSpecTest, ThresholdsAreForTheirCells) {
  const SweepSpec spec = read(kSpec);
  ASSERT_EQ(spec.thresholds.size(), 1u);
  EXPECT_TRUE(applies(spec.thresholds[0], spec, {0, 0, 1}));
  EXPECT_FALSE(applies(spec.thresholds[0], spec, {0, 0, 0}));
  EXPECT_FALSE(applies(spec.thresholds[0], spec, {0, 1, 1}));
}

TEST_F(SweepSpecTest, JudgesTheMeanOverTheSeedsAndCountsFailuresAsMissed) {
  const SweepSpec spec = read(kSpec);
  const std::vector<SweepCell> cells = sweepCells(spec);
  std::map<size_t, SweepRecord> records;
  for (size_t i = 0; i < cells.size(); ++i) {
    Metrics metrics;
    metrics.objects.push_back({"x", {}});
    metrics.objects[0].metrics.success_5cm_5deg = i % 2 ? 1.0 : 0.85;
    records[i] = {"done", 0, metrics, 1};
  }
  EXPECT_TRUE(judge(spec.thresholds[0], spec, cells, records).met);  // 0.925
  records[2].metrics->objects[0].metrics.success_5cm_5deg = 0.1;
  const ThresholdResult low = judge(spec.thresholds[0], spec, cells, records);
  EXPECT_FALSE(low.met);
  EXPECT_THAT(low.detail, HasSubstr("level 1"));
  records[2] = {"crashed", 11, {}, 1};
  EXPECT_FALSE(judge(spec.thresholds[0], spec, cells, records).met);
}

TEST_F(SweepSpecTest, ResultsHoldNeitherTimesNorFolders) {
  const SweepSpec spec = read(kSpec);
  const std::vector<SweepCell> cells = sweepCells(spec);
  std::map<size_t, SweepRecord> records;
  records[3] = {"timeout", 0, {}, 9.75};
  Metrics metrics;
  metrics.timing.wall_s = 123.25;
  records[5] = {"done", 0, metrics, 8.5};
  const std::string text = toCsv(resultsTable(spec, cells, records));
  EXPECT_THAT(text, HasSubstr("timeout"));
  for (const char* no : {"9.75", "8.5", "123.25", "wall_s", "peak_memory"})
    EXPECT_THAT(text, Not(HasSubstr(no)));
  EXPECT_THAT(toCsv(timingsTable(spec, cells, records)), HasSubstr("123.25"));
}

TEST_F(SweepSpecTest, SaysWhereSpecsAreWrong) {
  EXPECT_THAT(messageFor("factors: [{name: a, values: []}]"), HasSubstr("has no values"));
  EXPECT_THAT(messageFor("factors: [{name: a, values: [1], valuess: 2}]"), HasSubstr("valuess"));
  EXPECT_THAT(messageFor("scene: x\nfaktors: []"), HasSubstr("factors"));
  EXPECT_THAT(messageFor("factors: [{name: method, values: [ebt]}]\n"
                         "thresholds: [{metric: m, at_least: 1, where: {metod: ebt}}]"),
              HasSubstr("did you mean `method`?"));
  EXPECT_THAT(messageFor("factors: [{name: a, values: [1]}]\nthresholds: [{metric: m}]"),
              HasSubstr("at_least"));
  const SweepSpec no_scene = read("factors: [{name: seed_of, values: [1]}]");
  EXPECT_THROW(sweepCells(no_scene), InputError);
}

}  // namespace
}  // namespace diorama
