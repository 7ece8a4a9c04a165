#include "drivers/device/wake_event.hpp"

#include <limits>

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

TEST(WakeEvent, StaysSetUntilCleared) {
  WakeEvent event;
  ASSERT_TRUE(event.valid());
  EXPECT_FALSE(event.is_set());
  event.set();
  event.set();
  EXPECT_TRUE(event.is_set());
  EXPECT_TRUE(event.is_set());
  event.clear();
  EXPECT_FALSE(event.is_set());
  event.clear();
  EXPECT_FALSE(event.is_set());
}

TEST(PollUntil, ReturnsTheNumberOfReadyDescriptors) {
  const SteadyClock clock;
  WakeEvent a;
  WakeEvent b;
  b.set();
  std::array<pollfd, 2> entries = {pollfd{a.fd(), POLLIN, 0}, pollfd{b.fd(), POLLIN, 0}};
  EXPECT_EQ(poll_until(entries, std::chrono::hours(1), clock), 1);
  EXPECT_EQ(entries[0].revents, 0);
  EXPECT_EQ(entries[1].revents, POLLIN);
  b.clear();
  EXPECT_EQ(poll_until(entries, nanoseconds(0), clock), 0);
  EXPECT_EQ(poll_until(entries, nanoseconds(-5), clock), 0);
}

TEST(PollMilliseconds, RoundsUpAndStaysInRange) {
  EXPECT_EQ(poll_milliseconds(nanoseconds(0)), 0);
  EXPECT_EQ(poll_milliseconds(nanoseconds(1)), 1);
  EXPECT_EQ(poll_milliseconds(milliseconds(7)), 7);
  EXPECT_EQ(poll_milliseconds(nanoseconds(-1)), 0);
  EXPECT_EQ(poll_milliseconds(nanoseconds::max()), std::numeric_limits<int>::max());
}

TEST(DeadlineAfter, DoesNotOverflow) {
  EXPECT_EQ(deadline_after(milliseconds(5), milliseconds(7)), milliseconds(12));
  EXPECT_EQ(deadline_after(milliseconds(5), nanoseconds::max()), nanoseconds::max());
}

}  // namespace
}  // namespace trigmesh
