#include "eval/csv.h"

#include <gtest/gtest.h>

namespace diorama {
namespace {

TEST(Csv, ReadsBackWhatItWrites) {
  const std::vector<std::string> fields = {"plain", "a,b", "say \"x\"", "two\nlines", ""};
  const CsvTable table = parseCsv("1,2,3,4,5\n" + csvLine(fields));
  ASSERT_EQ(table.rows.size(), 1u);
  EXPECT_EQ(table.rows[0], fields);
}

TEST(Csv, ShortRowsAreFilledLongOnesCut) {
  const CsvTable table = parseCsv("a,b\n1\n\n1,2,3\r\n");
  ASSERT_EQ(table.rows.size(), 2u);
  EXPECT_EQ(table.rows[0], (std::vector<std::string>{"1", ""}));
  EXPECT_EQ(table.rows[1], (std::vector<std::string>{"1", "2"}));
  EXPECT_EQ(table.column("b"), 1u);
  EXPECT_FALSE(table.column("c"));
}

TEST(Csv, AnyTextGivesATable) {
  EXPECT_TRUE(parseCsv("").header.empty());
  EXPECT_EQ(parseCsv("\"open").header, std::vector<std::string>{"open"});
  EXPECT_EQ(parseCsv("a\n\"x").rows.size(), 1u);
}

}  // namespace
}  // namespace diorama
