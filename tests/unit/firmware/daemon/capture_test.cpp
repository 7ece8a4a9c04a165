// The camera's thread before a scripted camera: what it does about each kind of fault.

#include "firmware/daemon/capture.hpp"

#include <chrono>
#include <memory>
#include <optional>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/camera/mock/mock_source.hpp"
#include "tests/unit/firmware/daemon/test_frames.hpp"

namespace trigmesh {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

class CaptureTest : public ::testing::Test {
 protected:
  ~CaptureTest() override { thread_.reset(); }

  static MockFrame frame() {
    MockFrame frame;
    frame.bytes = test_support::grey_lines(10);
    frame.layout.format = PixelFormat::kGrey;
    frame.layout.width_px = 64;
    frame.layout.height_px = 48;
    frame.layout.stride_bytes = 64;
    return frame;
  }

  void run(MockScript script) {
    source_ = std::make_unique<MockFrameSource>(std::move(script), clock_);
    capture_.emplace(
        options_,
        CaptureParts{
            *source_, copies_, orders_, storage_, rig_, drops_, faults_, heartbeat_, clock_});
    thread_.emplace([this](const std::stop_token& stop) { capture_->run(stop, [] {}); });
  }

  /// What the rig hears next of the camera.
  CameraPresence next_presence() {
    const auto input = rig_.pop({}, seconds(30));
    EXPECT_TRUE(input);
    const auto* changed = input ? std::get_if<CameraChanged>(&*input) : nullptr;
    EXPECT_NE(changed, nullptr);
    return changed == nullptr ? CameraPresence::kAway : changed->presence;
  }

  SteadyClock clock_;
  CaptureOptions options_;
  FrameCopies copies_{8};
  CaptureQueue orders_{16, OverflowPolicy::kBlock};
  StorageInbox storage_{8, 16};
  RigQueue rig_{64, OverflowPolicy::kBlock};
  FrameDrops drops_;
  Faults faults_{clock_, seconds(60)};
  Heartbeat heartbeat_{"camera", clock_};
  std::unique_ptr<MockFrameSource> source_;
  std::optional<Capture> capture_;
  std::optional<std::jthread> thread_;
};

TEST_F(CaptureTest, TellsThatTheCameraIsThereWithItsFirstFrame) {
  run({.steps = {frame()}, .starts = {}, .info = {}});
  EXPECT_EQ(next_presence(), CameraPresence::kThere);
}

TEST_F(CaptureTest, TriesACameraThatIsAwayUntilItComes) {
  run({.steps = {frame()}, .starts = {FaultKind::kNotFound, FaultKind::kBusy}, .info = {}});
  EXPECT_EQ(next_presence(), CameraPresence::kThere);
  thread_.reset();
  EXPECT_EQ(source_->start_count(), 3U);
  EXPECT_EQ(faults_.text(), "") << "over";
}

TEST_F(CaptureTest, ADisconnectedCameraIsLostAndComesBack) {
  run({.steps = {frame(), MockFault{FaultKind::kDisconnected}, frame()}, .starts = {}, .info = {}});
  EXPECT_EQ(next_presence(), CameraPresence::kThere);
  EXPECT_EQ(next_presence(), CameraPresence::kAway);
  EXPECT_EQ(next_presence(), CameraPresence::kThere);
}

TEST_F(CaptureTest, ASilentCameraIsStartedAnewAndNotLostWhenThatHelps) {
  options_.silence = milliseconds(50);
  run({.steps = {frame(), MockFault{FaultKind::kIo}, frame(), MockFault{FaultKind::kDisconnected}},
       .starts = {},
       .info = {}});
  EXPECT_EQ(next_presence(), CameraPresence::kThere);
  EXPECT_EQ(next_presence(), CameraPresence::kAway) << "only when it was unplugged";
  thread_.reset();
  EXPECT_GE(source_->start_count(), 2U);
}

TEST_F(CaptureTest, ACameraThatStaysSilentIsLost) {
  options_.silence = milliseconds(50);
  run({.steps = {frame()}, .starts = {}, .info = {}});
  EXPECT_EQ(next_presence(), CameraPresence::kThere);
  EXPECT_EQ(next_presence(), CameraPresence::kAway);
}

TEST_F(CaptureTest, DamagedFramesAreCountedAndManyAreAFault) {
  MockScript script;
  script.steps.emplace_back(frame());
  for (int i = 0; i < 30; ++i) {
    script.steps.emplace_back(MockFault{FaultKind::kCorruptFrame});
  }
  script.steps.emplace_back(frame());
  run(std::move(script));
  EXPECT_EQ(next_presence(), CameraPresence::kThere);
  EXPECT_EQ(next_presence(), CameraPresence::kAway);
  EXPECT_EQ(next_presence(), CameraPresence::kThere);
  EXPECT_EQ(drops_.corrupt, 30U);
}

TEST_F(CaptureTest, GapsOfTheSensorAreCounted) {
  MockFrame late = frame();
  late.lost_before = 4;
  run({.steps = {late}, .starts = {}, .info = {}});
  EXPECT_EQ(next_presence(), CameraPresence::kThere);
  EXPECT_EQ(drops_.sensor, 4U);
}

TEST_F(CaptureTest, ARecordingWithoutAReadableFrameIsAFault) {
  run({.steps = {MockEnd{}}, .starts = {}, .info = {}});
  const auto limit = clock_.now() + seconds(30);
  while (faults_.text().empty() && clock_.now() < limit) {
    std::this_thread::yield();
  }
  EXPECT_THAT(faults_.text(), HasSubstr("no frame that can be read"));
}

TEST_F(CaptureTest, AStillThatGetsNoFrameIsAnswered) {
  options_.stills.wait = milliseconds(20);
  run({.steps = {frame()}, .starts = {}, .info = {}});
  EXPECT_EQ(next_presence(), CameraPresence::kThere);
  (void)orders_.push(TakeStillFrame{SessionSerial{1}, StillTicket{7}, clock_.now() + seconds(1)});
  const auto input = rig_.pop({}, seconds(30));
  ASSERT_TRUE(input);
  const auto* answer = std::get_if<StillAnswered>(&*input);
  ASSERT_NE(answer, nullptr);
  EXPECT_EQ(answer->ticket, StillTicket{7});
  EXPECT_FALSE(answer->number);
}

}  // namespace
}  // namespace trigmesh
