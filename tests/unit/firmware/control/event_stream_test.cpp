#include "firmware/control/event_stream.hpp"

#include <string>

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

constexpr std::string_view kTwoEvents =
    ": nothing new\n\nid: 7\nevent: phase\ndata: {\"a\":1}\n\nid:8\r\nevent:b\r\ndata:c\r\n\r\n";

void expect_two(const std::vector<ControlEvent>& events) {
  ASSERT_EQ(events.size(), 2U);
  EXPECT_EQ(events[0].number, 7U);
  EXPECT_EQ(events[0].kind, "phase");
  EXPECT_EQ(events[0].data, "{\"a\":1}");
  EXPECT_EQ(events[1].number, 8U);
  EXPECT_EQ(events[1].kind, "b");
  EXPECT_EQ(events[1].data, "c");
}

TEST(EventStreamReader, ReadsEventsAndLeavesCommentsOut) {
  EventStreamReader reader;
  expect_two(reader.add(kTwoEvents).value());
}

TEST(EventStreamReader, ReadsThemInPiecesOfAnySize) {
  for (std::size_t size = 1; size < kTwoEvents.size(); ++size) {
    EventStreamReader reader;
    std::vector<ControlEvent> events;
    for (std::size_t at = 0; at < kTwoEvents.size(); at += size) {
      const auto some = reader.add(kTwoEvents.substr(at, size));
      ASSERT_TRUE(some);
      events.insert(events.end(), some->begin(), some->end());
    }
    expect_two(events);
  }
}

TEST(EventStreamReader, KeepsAnEventThatIsNotComplete) {
  EventStreamReader reader;
  EXPECT_TRUE(reader.add("id: 1\nevent: a\ndata: b\n").value().empty());
  EXPECT_EQ(reader.add("\n").value().size(), 1U);
  EXPECT_TRUE(reader.add("\n\n").value().empty());
}

TEST(EventStreamReader, TakesALineOfTheLongestSizeAndNoLonger) {
  EventStreamReader reader;
  const std::string longest(EventStreamReader::kMaxEventBytes, 'x');
  EXPECT_TRUE(reader.add(longest));
  const auto refused = reader.add("x");
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kCorruptData);
}

}  // namespace
}  // namespace trigmesh
