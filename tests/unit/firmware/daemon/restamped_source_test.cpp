#include "firmware/daemon/restamped_source.hpp"

#include <chrono>
#include <memory>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/camera/mock/mock_source.hpp"
#include "tests/support/manual_clock.hpp"

namespace trigmesh {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using std::chrono::seconds;
using ::testing::ElementsAre;

/// The times of three frames that were recorded at 5000, 5170 and 5330 ms; the clock goes on by 7
/// ms a frame.
std::vector<nanoseconds> times(Restamping restamping) {
  test_support::ManualClock clock;
  MockScript script;
  for (const int time_ms : {5000, 5170, 5330}) {
    script.steps.emplace_back(
        MockFrame{.bytes = {1}, .layout = {}, .timestamp = milliseconds(time_ms)});
  }
  RestampedSource source(
      std::make_unique<MockFrameSource>(std::move(script), clock), restamping, clock);
  EXPECT_TRUE(source.start());
  std::vector<nanoseconds> seen;
  for (int i = 0; i < 3; ++i) {
    clock.time += milliseconds(7);
    const FrameEvent event = source.wait(seconds(1));
    seen.push_back(*std::get<Frame>(event).info().timestamp - seconds(100));
  }
  return seen;
}

TEST(RestampedSource, AtRecordedSpeedFramesKeepTheirDistances) {
  EXPECT_THAT(times(Restamping::kShifted),
              ElementsAre(milliseconds(0), milliseconds(170), milliseconds(330)));
}

TEST(RestampedSource, AtOtherSpeedsAFrameIsOfNow) {
  EXPECT_THAT(times(Restamping::kDelivered),
              ElementsAre(milliseconds(7), milliseconds(14), milliseconds(21)));
}

}  // namespace
}  // namespace trigmesh
