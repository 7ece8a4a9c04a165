#include "drivers/camera/mock/mock_source.hpp"

#include <utility>

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using std::chrono::nanoseconds;

const SteadyClock kClock;

MockFrame frame(std::uint8_t value) {
  return {.bytes = {value}, .layout = {}, .timestamp = nanoseconds(value), .lost_before = 0};
}

FaultKind fault_of(const FrameEvent& event) {
  const auto* fault = std::get_if<DeviceFault>(&event);
  EXPECT_NE(fault, nullptr);
  return fault != nullptr ? fault->kind : FaultKind::kNotStarted;
}

TEST(MockFrameSource, PlaysItsScriptInOrder) {
  MockScript script;
  script.steps = {
      frame(1), MockFault{FaultKind::kCorruptFrame}, frame(2), MockSilence{}, MockEnd{}};
  MockFrameSource source(std::move(script), kClock);
  ASSERT_TRUE(source.start());
  EXPECT_EQ(std::get<Frame>(source.wait(nanoseconds(0))).bytes()[0], 1);
  EXPECT_EQ(fault_of(source.wait(nanoseconds(0))), FaultKind::kCorruptFrame);
  {
    const FrameEvent event = source.wait(nanoseconds(0));
    const Frame& second = std::get<Frame>(event);
    EXPECT_EQ(second.info().sequence, 2U) << "the damaged one has a number too";
    EXPECT_EQ(second.info().missed_before, 0U) << "and was reported already";
    EXPECT_EQ(source.frames_out(), 1U);
  }
  EXPECT_EQ(source.frames_out(), 0U);
  EXPECT_EQ(fault_of(source.wait(nanoseconds(0))), FaultKind::kTimeout);
  EXPECT_TRUE(std::holds_alternative<EndOfFrames>(source.wait(nanoseconds(0))));
  EXPECT_EQ(source.counters().frames, 2U);
}

TEST(MockFrameSource, LosesFramesForWhichNoBufferIsFree) {
  MockScript script;
  script.buffer_count = 1;
  script.steps = {frame(1), frame(2), MockSilence{}, frame(3)};
  MockFrameSource source(std::move(script), kClock);
  ASSERT_TRUE(source.start());
  FrameEvent held = source.wait(nanoseconds(0));
  EXPECT_EQ(fault_of(source.wait(nanoseconds(0))), FaultKind::kTimeout) << "frame 2 is lost";
  std::get<Frame>(held).release();
  const FrameEvent third = source.wait(nanoseconds(0));
  EXPECT_EQ(std::get<Frame>(third).bytes()[0], 3);
  EXPECT_EQ(std::get<Frame>(third).info().missed_before, 1U);
  EXPECT_EQ(source.counters().missed, 1U);
  EXPECT_EQ(source.counters().faults.of(FaultKind::kGap), 1U);
}

TEST(MockFrameSource, IsUnpluggedAndComesBack) {
  MockScript script;
  script.steps = {MockFault{FaultKind::kDisconnected}, frame(9)};
  script.starts = {std::nullopt, FaultKind::kNotFound, std::nullopt};
  MockFrameSource source(std::move(script), kClock);
  ASSERT_TRUE(source.start());
  EXPECT_EQ(fault_of(source.wait(nanoseconds(0))), FaultKind::kDisconnected);
  EXPECT_EQ(fault_of(source.wait(nanoseconds(0))), FaultKind::kNotStarted);
  source.stop();
  const auto again = source.start();
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().kind, FaultKind::kNotFound);
  ASSERT_TRUE(source.start());
  EXPECT_EQ(std::get<Frame>(source.wait(nanoseconds(0))).info().sequence, 0U);
  EXPECT_EQ(source.start_count(), 3U);
}

}  // namespace
}  // namespace trigmesh
