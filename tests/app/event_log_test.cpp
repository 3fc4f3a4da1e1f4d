#include "app/event_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "eval/csv.h"

namespace diorama {
namespace {

constexpr int64_t kStep_ns = 100'000'000;

Event eventAt(int k, const std::string& event, const std::string& reason, double value = 0) {
  return {k * kStep_ns, "box", event, value, reason};
}

TEST(EventLog, ADecisionOfEveryFrameIsOneEventWithItsEnd) {
  EventLog log;
  log.add({eventAt(0, "lost", "hidden")});
  for (int k = 1; k <= 4; ++k) log.add({eventAt(k, "reset", "restarted", k)});
  log.add({});
  log.add({eventAt(6, "reset", "restarted", 1)});
  EXPECT_EQ(log.csv(),
            "timestamp,source,event,value,reason,until,frames\n"
            "0.000000,box,lost,0,hidden,0.000000,1\n"
            "0.100000,box,reset,1,restarted,0.400000,4\n"
            "0.600000,box,reset,1,restarted,0.600000,1\n");
}

TEST(EventLog, FiguresInAReasonMakeNoOtherDecisionButOtherReasonsDo) {
  EventLog log;
  log.add({eventAt(0, "rejected", "outside the gate: 31.0", 31)});
  log.add({eventAt(1, "rejected", "outside the gate: 44.2", 44)});
  log.add({eventAt(2, "rejected", "agrees with another place", 50)});
  const CsvTable table = parseCsv(log.csv());
  ASSERT_EQ(table.rows.size(), 2u);
  EXPECT_EQ(table.rows[0][6], "2");
  EXPECT_EQ(table.rows[0][4], "outside the gate: 31.0");
}

TEST(EventLog, SourcesAndTwiceInAFrameAreKeptApart) {
  EventLog log;
  Event other = eventAt(1, "lost", "");
  other.source = "a \"quoted\", name";
  log.add({eventAt(0, "lost", ""), eventAt(0, "lost", "")});
  log.add({other, eventAt(1, "lost", "")});
  const CsvTable table = parseCsv(log.csv());
  ASSERT_EQ(table.rows.size(), 3u);
  EXPECT_EQ(table.rows[0][6], "2");
  EXPECT_EQ(table.rows[1][6], "1");
  EXPECT_EQ(table.rows[2][1], other.source);
}

}  // namespace
}  // namespace diorama
