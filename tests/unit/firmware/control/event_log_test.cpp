#include "firmware/control/event_log.hpp"

#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

std::vector<std::string> data_of(const std::vector<ControlEvent>& events) {
  std::vector<std::string> data;
  for (const ControlEvent& event : events) {
    data.push_back(event.data);
  }
  return data;
}

TEST(EventLog, GivesWhatCameAfter) {
  EventLog log(3);
  EXPECT_THAT(log.wait_after(0, milliseconds(0)), IsEmpty());
  for (const char* data : {"a", "b", "c", "d"}) {
    log.publish("test", data);
  }
  EXPECT_THAT(data_of(log.wait_after(2, milliseconds(0))), ElementsAre("c", "d"));
  EXPECT_THAT(data_of(log.wait_after(0, milliseconds(0))), ElementsAre("b", "c", "d"));
  EXPECT_THAT(data_of(log.wait_after(99, milliseconds(0))), ElementsAre("b", "c", "d"));
  EXPECT_THAT(log.wait_after(4, milliseconds(0)), IsEmpty());
  EXPECT_EQ(log.last_number(), 4U);
}

TEST(EventLog, WakesAWatcher) {
  EventLog log(3);
  std::vector<ControlEvent> seen;
  {
    const std::jthread watcher([&] { seen = log.wait_after(0, std::chrono::minutes(10)); });
    log.publish("test", "a");
  }
  EXPECT_THAT(data_of(seen), ElementsAre("a"));
}

TEST(EventLog, ClosingEndsAllWaiting) {
  EventLog log(3);
  {
    const std::jthread watcher([&] { (void)log.wait_after(0, std::chrono::minutes(10)); });
    log.close();
  }
  EXPECT_TRUE(log.is_closed());
  EXPECT_THAT(log.wait_after(0, std::chrono::minutes(10)), IsEmpty());
}

}  // namespace
}  // namespace trigmesh
