#include "drivers/camera/libcamera/frame_stamp.hpp"

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using std::chrono::nanoseconds;
using namespace std::chrono_literals;

constexpr nanoseconds kNow = 1000s;

TEST(ChooseStamp, TakesTheSensorsTimeBeforeTheBuffers) {
  EXPECT_EQ(choose_stamp({.sensor = kNow - 50ms, .buffer = kNow - 10ms}, kNow, {}),
            (FrameStamp{kNow - 50ms, FrameMoment::kExposureStart}));
  EXPECT_EQ(choose_stamp({.sensor = {}, .buffer = kNow - 10ms}, kNow, {}),
            (FrameStamp{kNow - 10ms, FrameMoment::kFrameEnd}));
}

TEST(ChooseStamp, PassesOverATimeOfAnotherClock) {
  // The boot clock runs ahead of the monotonic one by the time that the board slept.
  EXPECT_EQ(choose_stamp({.sensor = kNow + 5s, .buffer = kNow - 10ms}, kNow, {}),
            (FrameStamp{kNow - 10ms, FrameMoment::kFrameEnd}));
  EXPECT_EQ(choose_stamp({.sensor = 3s, .buffer = 4s}, kNow, {}),
            (FrameStamp{kNow, FrameMoment::kReceived}));
}

TEST(ChooseStamp, NeverGoesBack) {
  EXPECT_EQ(choose_stamp({.sensor = kNow - 50ms, .buffer = {}}, kNow, kNow - 50ms),
            (FrameStamp{kNow, FrameMoment::kReceived}));
  EXPECT_EQ(choose_stamp({.sensor = kNow - 50ms, .buffer = kNow - 10ms}, kNow, kNow - 20ms),
            (FrameStamp{kNow - 10ms, FrameMoment::kFrameEnd}));
}

TEST(ChooseStamp, StampsItselfWhereNothingIsTold) {
  EXPECT_EQ(choose_stamp({}, kNow, {}), (FrameStamp{kNow, FrameMoment::kReceived}));
}

}  // namespace
}  // namespace trigmesh
