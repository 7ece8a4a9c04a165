#include "drivers/trigger/scripted/event_table.hpp"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using std::chrono::nanoseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr TriggerAction kDown = TriggerAction::kPressed;
constexpr TriggerAction kUp = TriggerAction::kReleased;

std::string reason(const std::string& rows) {
  const auto edges =
      parse_events("timestamp_ns,line,edge\n" + rows, "events.csv", ButtonWiring::kActiveLow, 100);
  return edges ? "accepted" : edges.error().message;
}

TEST(ParseEvents, ReadsTheEdgesOfARecording) {
  const auto edges = parse_events(
      "timestamp_ns,line,edge\r\n5040000000,0,falling\r\n\r\n5165000000,0,rising\r\n"
      "5165000000,3,falling,more\n",
      "events.csv",
      ButtonWiring::kActiveLow,
      100);
  ASSERT_TRUE(edges) << edges.error().message;
  EXPECT_THAT(*edges,
              ElementsAre(TriggerEdge{nanoseconds(5040000000), 0, kDown},
                          TriggerEdge{nanoseconds(5165000000), 0, kUp},
                          TriggerEdge{nanoseconds(5165000000), 3, kDown}));
}

TEST(ParseEvents, TheWiringSaysWhatAPressIs) {
  const auto edges = parse_events("timestamp_ns,line,edge,who\n1,0,rising\n2,0,falling\n",
                                  "events.csv",
                                  ButtonWiring::kActiveHigh,
                                  100);
  ASSERT_TRUE(edges) << edges.error().message;
  EXPECT_EQ((*edges)[0].action, kDown);
  EXPECT_EQ((*edges)[1].action, kUp);
}

TEST(ParseEvents, NamesTheLineAndWhatIsWrongWithIt) {
  EXPECT_THAT(reason("5,0\n"), HasSubstr("events.csv:2: expected a timestamp"));
  EXPECT_THAT(reason("soon,0,falling\n"), HasSubstr(":2: the timestamp must be"));
  EXPECT_THAT(reason("-1,0,falling\n"), HasSubstr(":2: the timestamp must be"));
  EXPECT_THAT(reason("1,1024,falling\n"), HasSubstr("0 to 1023"));
  EXPECT_EQ(reason("1,1023,falling\n"), "accepted");
  EXPECT_THAT(reason("1,0,down\n"), HasSubstr("'falling' or 'rising'"));
  EXPECT_THAT(reason("\n9,0,falling\n8,0,rising\n"), HasSubstr(":4: the timestamp goes back"));
  EXPECT_THAT(reason("1,0,rising\n"), HasSubstr("released before it was pressed"));
  EXPECT_THAT(reason("1,0,falling\n2,0,falling\n"), HasSubstr(":3: the same edge"));
  EXPECT_THAT(reason("1,0,falling," + std::string(5000, 'x')), HasSubstr("too long"));
}

TEST(ParseEvents, RefusesAnotherTable) {
  for (const char* text : {"", "name,timestamp_ns\n", "timestamp_ns,line,edges\n"}) {
    const auto edges = parse_events(text, "events.csv", ButtonWiring::kActiveLow, 100);
    ASSERT_FALSE(edges) << text;
    EXPECT_THAT(edges.error().message, HasSubstr("events.csv:1: "));
  }
}

TEST(ParseEvents, HoldsItsLimit) {
  const std::string text = "timestamp_ns,line,edge\n1,0,falling\n2,0,rising\n";
  EXPECT_TRUE(parse_events(text, "events.csv", ButtonWiring::kActiveLow, 2));
  EXPECT_EQ(parse_events(text, "events.csv", ButtonWiring::kActiveLow, 1).error().code,
            ErrorCode::kLimitExceeded);
}

}  // namespace
}  // namespace trigmesh
