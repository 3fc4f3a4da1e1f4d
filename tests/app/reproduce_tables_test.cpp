#include "app/reproduce_tables.h"

#include <gmock/gmock.h>

#include "app/paper.h"
#include "tests/support/temporary_folder.h"

namespace diorama {
namespace {

using testing::HasSubstr;

class ReproduceTables : public testing::Test {
 protected:
  void SetUp() override {
    for (size_t s = 0; s < std::size(kPaper); ++s) {
      ReproducedSequence sequence{kPaper[s].title, {}, {}};
      for (size_t m = 0; m < 3; ++m) {
        Metrics& metrics = sequence.metrics[m];
        metrics.frames = 10;
        metrics.start_frame = 5;
        metrics.objects.push_back({"x", {}});
        metrics.objects[0].metrics.mean_error_m = 0.004 - 0.001 * double(m);
        metrics.objects[0].metrics.ratio_below_0_5_m = 0.5;
        metrics.camera.ate_mean_m = 0.001;
        sequence.folders[m] = folder_ / (std::to_string(s) + kMethods[m]);
        write(sequence.folders[m]);
      }
      sequences_.push_back(sequence);
    }
  }
  // A camera that is off by 1 mm in turn to the left and to the right.
  void write(const std::filesystem::path& run) {
    std::filesystem::create_directories(run / "truth");
    std::string estimate, truth;
    for (int k = 0; k < 100; ++k) {
      const std::string t = std::to_string(0.1 * k) + " ", x = std::to_string(0.01 * k);
      estimate += t + x + (k % 2 ? " 0.001" : " -0.001") + " 0 0 0 0 1\n";
      truth += t + x + " 0 0 0 0 0 1\n";
    }
    std::ofstream(run / "camera_online.txt") << estimate;
    std::ofstream(run / "truth/camera.txt") << truth;
    std::ofstream(run / "errors.csv") << "timestamp,err_m,visible_fraction\n0,0.001,1\n0.1,,0.5\n";
  }
  test::TemporaryFolder folder_;
  std::vector<ReproducedSequence> sequences_;
};

TEST_F(ReproduceTables, StandBesideThePublishedFigures) {
  const std::vector<ReproducedTable> tables = reproducedTables(sequences_);
  ASSERT_EQ(tables.size(), 4u);
  const auto& first = tables[0].table.rows.at(0);
  EXPECT_EQ(first[0], "orange juice");
  EXPECT_EQ(first[1], "4.00 (189)");
  EXPECT_EQ(first[3], "2.00 (192)");
  EXPECT_EQ(first[6], "100.0 (33.7)");  // of the frames since the start
  const auto& all = tables[2].table.rows.back();
  EXPECT_EQ(all[0], "All");
  EXPECT_THAT(all[1], HasSubstr("1.00 ± 0.0"));  // of all frames of all sequences
  for (const ReproducedTable& table : tables)
    for (const auto& row : table.table.rows) EXPECT_LE(row.size(), table.table.header.size());
}

TEST_F(ReproduceTables, CompareWhatAllMethodsAnswerFor) {
  const std::filesystem::path& tracker = sequences_[0].folders[1];
  std::ofstream(tracker / "errors.csv")
      << "timestamp,err_m,visible_fraction\n0,0.003,1\n0.1,,0.5\n";
  for (const size_t m : {0u, 2u})
    std::ofstream(sequences_[0].folders[m] / "errors.csv")
        << "timestamp,err_m,visible_fraction\n0,0.002,1\n0.1,0.02,0.5\n";
  for (const auto& folder : sequences_[1].folders)
    std::ofstream(folder / "errors.csv") << "timestamp,err_m,visible_fraction\n0,0.7,1\n0.1,,0.5\n";
  const auto rows = reproducedTables(sequences_).at(1).table.rows;
  EXPECT_THAT(rows.at(0), testing::ElementsAre(kPaper[0].title, "2.00", "3.00", "2.00", "50.0"));
  EXPECT_THAT(rows.at(1), testing::ElementsAre(kPaper[1].title, "–", "–", "–", "0.0"));
}

TEST_F(ReproduceTables, TheHeadlineIsTheGainOverTheTracker) {
  EXPECT_THAT(headline(sequences_), HasSubstr("2.00 mm, 33.3% less"));
  EXPECT_THAT(headline(sequences_), HasSubstr("in the paper 231 mm, 8.1% less than 252 mm"));
  std::ofstream(sequences_[0].folders[1] / "errors.csv")
      << "timestamp,err_m,visible_fraction\n0,0.007,1\n0.1,,0.5\n";
  EXPECT_THAT(headline(sequences_),
              HasSubstr("every method answers it is 1.00 mm, 50.0% less than 2.00 mm"));
  sequences_[2].metrics[1].objects[0].metrics.mean_error_m.reset();
  EXPECT_THAT(headline(sequences_), HasSubstr("pasta box: ebt"));
}

TEST_F(ReproduceTables, PanelsHoldEveryFrame) {
  const std::vector<ErrorPanel> panels = errorPanels(sequences_);
  ASSERT_EQ(panels.size(), std::size(kPaper));
  EXPECT_EQ(panels[0].times_s, (std::vector<double>{0, 0.1}));
  EXPECT_EQ(panels[0].curves.at(2).error_m.at(0), 0.001);
  EXPECT_FALSE(panels[0].curves[2].error_m.at(1));
  EXPECT_THAT(toMarkdown(reproducedTables(sequences_)), HasSubstr("| All |"));
}

}  // namespace
}  // namespace diorama
