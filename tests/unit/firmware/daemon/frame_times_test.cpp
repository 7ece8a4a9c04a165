#include "firmware/daemon/frame_times.hpp"

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr nanoseconds kInterval = milliseconds(33);
constexpr nanoseconds kNow = milliseconds(9000);

FrameInfo info_at(FrameMoment moment) {
  FrameInfo info;
  info.timestamp = milliseconds(1000);
  info.moment = moment;
  info.exposure = milliseconds(10);
  return info;
}

TEST(FrameTimes, AroundTheMiddleOfTheExposure) {
  const FrameTimes times = times_of_frame(info_at(FrameMoment::kExposureMiddle), kInterval, kNow);
  EXPECT_EQ(times, (FrameTimes{milliseconds(995), milliseconds(1005), milliseconds(1000)}));
}

TEST(FrameTimes, AfterTheStartOfTheExposure) {
  const FrameTimes times = times_of_frame(info_at(FrameMoment::kExposureStart), kInterval, kNow);
  EXPECT_EQ(times, (FrameTimes{milliseconds(1000), milliseconds(1010), milliseconds(1005)}));
}

TEST(FrameTimes, TheEarliestPossibleEndBeforeTheLastByte) {
  const FrameTimes times = times_of_frame(info_at(FrameMoment::kFrameEnd), kInterval, kNow);
  EXPECT_EQ(times.end, milliseconds(967));
  EXPECT_EQ(times.begin, milliseconds(957));
}

TEST(FrameTimes, AFrameWithoutATimeMayHaveWaited) {
  FrameInfo info = info_at(FrameMoment::kExposureMiddle);
  info.timestamp.reset();
  const FrameTimes times = times_of_frame(info, kInterval, kNow);
  EXPECT_EQ(times.end, kNow - 2 * kInterval);
  EXPECT_EQ(times_of_frame(info_at(FrameMoment::kReceived), kInterval, kNow).end,
            milliseconds(1000) - 2 * kInterval);
}

TEST(FrameTimes, AnUnknownExposureIsTakenForNone) {
  FrameInfo info = info_at(FrameMoment::kExposureStart);
  info.exposure.reset();
  const FrameTimes times = times_of_frame(info, kInterval, kNow);
  EXPECT_EQ(times.begin, times.end);
}

TEST(FrameTimes, TheMiddleIsNeverBeforeTheClockBegan) {
  FrameInfo info = info_at(FrameMoment::kReceived);
  info.timestamp = milliseconds(1);
  EXPECT_EQ(times_of_frame(info, kInterval, kNow).middle, nanoseconds(0));
}

}  // namespace
}  // namespace trigmesh
