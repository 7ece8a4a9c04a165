#include "drivers/camera/v4l2/v4l2_source.hpp"

#include <algorithm>
#include <cerrno>

#include "tests/unit/drivers/camera/v4l2/fake_camera.hpp"

namespace trigmesh {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

using V4l2SourceTest = test_support::FakeCameraTest;

TEST_F(V4l2SourceTest, DeliversFramesInTheMemoryOfTheDriver) {
  const auto source = make();
  const auto started = source->start();
  ASSERT_TRUE(started) << started.error().message;
  EXPECT_EQ(source->info().stable_name, "/dev/v4l/by-id/usb-Fake-index0");
  EXPECT_EQ(source->info().layout, (FrameLayout{PixelFormat::kGrey, 8, 4, 8}));
  EXPECT_EQ(source->info().buffer_count, 4U);
  kernel_->frames = {grey_frame(7), grey_frame(8)};
  {
    const FrameEvent event = source->wait(1s);
    const Frame& frame = std::get<Frame>(event);
    EXPECT_EQ(frame.bytes().size(), 32U);
    EXPECT_EQ(frame.bytes()[0], 7);
    EXPECT_EQ(kernel_->mappings.count(frame.bytes().data()), 1U) << "not copied";
    EXPECT_EQ(frame.info().timestamp, 50'231ms);
    EXPECT_EQ(frame.info().moment, FrameMoment::kFrameEnd);
    EXPECT_EQ(kernel_->queued, 3U);
  }
  EXPECT_EQ(kernel_->queued, 4U);
  EXPECT_EQ(std::get<Frame>(source->wait(1s)).info().sequence, 1U);
  EXPECT_EQ(kernel_->poll_count, 0U) << "frames that are ready need no poll";
}

TEST_F(V4l2SourceTest, AsksForARateThatIsNotBeyondTheModes) {
  const auto source = make();
  ASSERT_TRUE(source->start());
  EXPECT_EQ(kernel_->interval.numerator, 333'334U) << "not shorter than a thirtieth";
  EXPECT_EQ(kernel_->interval.denominator, 10'000'000U);
  EXPECT_EQ(source->info().frame_interval, std::chrono::nanoseconds(33'333'400));
}

TEST_F(V4l2SourceTest, TimesOutAndGoesOn) {
  const auto source = make();
  ASSERT_TRUE(source->start());
  EXPECT_EQ(fault_of(source->wait(0ns)), FaultKind::kTimeout);
  EXPECT_EQ(fault_of(source->wait(2s)), FaultKind::kTimeout);
  EXPECT_EQ(time_.time, 102s);
  kernel_->frames = {grey_frame(0)};
  EXPECT_TRUE(std::holds_alternative<Frame>(source->wait(0ns)));
}

TEST_F(V4l2SourceTest, SaysWhenNobodyReleasesFrames) {
  const auto source = make();
  ASSERT_TRUE(source->start());
  std::vector<FrameEvent> held;
  for (std::uint32_t i = 0; i < 4; ++i) {
    kernel_->frames.push_back(grey_frame(i));
    held.push_back(source->wait(1s));
  }
  const FrameEvent starved = source->wait(1s);
  EXPECT_EQ(fault_of(starved), FaultKind::kTimeout);
  EXPECT_THAT(std::get<DeviceFault>(starved).message, HasSubstr("not released"));
}

TEST_F(V4l2SourceTest, PassesOverDamagedFramesAndCountsWhatIsMissing) {
  const auto source = make();
  ASSERT_TRUE(source->start());
  auto damaged = grey_frame(3);
  damaged.flags |= V4L2_BUF_FLAG_ERROR;
  auto too_short = grey_frame(4);
  too_short.bytes.resize(31);
  auto too_long = grey_frame(5);
  too_long.claimed_bytes = 1 << 20;
  kernel_->frames = {grey_frame(0), damaged, too_short, too_long, grey_frame(7)};
  EXPECT_TRUE(std::holds_alternative<Frame>(source->wait(1s)));
  EXPECT_EQ(fault_of(source->wait(1s)), FaultKind::kCorruptFrame);
  EXPECT_EQ(fault_of(source->wait(1s)), FaultKind::kShortFrame);
  EXPECT_EQ(fault_of(source->wait(1s)), FaultKind::kCorruptFrame);
  EXPECT_EQ(kernel_->queued, 4U) << "their buffers went back";
  const FrameEvent event = source->wait(1s);
  EXPECT_EQ(std::get<Frame>(event).info().sequence, 7U);
  EXPECT_EQ(std::get<Frame>(event).info().missed_before, 3U) << "1, 2 and 6";
  EXPECT_EQ(source->counters().missed, 3U);
  EXPECT_EQ(source->counters().frames, 2U);
  EXPECT_EQ(source->counters().faults.of(FaultKind::kGap), 2U);
}

TEST_F(V4l2SourceTest, DoesNotBelieveImpossibleTimestamps) {
  const auto source = make();
  ASSERT_TRUE(source->start());
  auto from_the_future = grey_frame(0);
  from_the_future.timestamp = 101s;
  auto without = grey_frame(1);
  without.flags = V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN;
  auto start_of_exposure = grey_frame(2);
  start_of_exposure.timestamp = 100'500ms;
  start_of_exposure.flags |= V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  auto backwards = grey_frame(3);
  kernel_->frames = {from_the_future, without, start_of_exposure, backwards};
  const auto next = [&] {
    const FrameEvent event = source->wait(1s);
    return std::pair(*std::get<Frame>(event).info().timestamp,
                     std::get<Frame>(event).info().moment);
  };
  EXPECT_EQ(next(), std::pair(std::chrono::nanoseconds(100s), FrameMoment::kReceived));
  time_.time = 100'100ms;
  EXPECT_EQ(next(), std::pair(std::chrono::nanoseconds(100'100ms), FrameMoment::kReceived));
  time_.time = 100'600ms;
  EXPECT_EQ(next(), std::pair(std::chrono::nanoseconds(100'500ms), FrameMoment::kExposureStart));
  EXPECT_EQ(next(), std::pair(std::chrono::nanoseconds(100'600ms), FrameMoment::kReceived));
}

TEST_F(V4l2SourceTest, IsUnpluggedAndFindsItsCameraAgain) {
  const auto source = make();
  ASSERT_TRUE(source->start());
  kernel_->frames = {grey_frame(0)};
  const FrameEvent held = source->wait(1s);
  kernel_->is_plugged = false;
  EXPECT_EQ(fault_of(source->wait(1s)), FaultKind::kDisconnected);
  EXPECT_TRUE(kernel_->open_fds.empty()) << "let go at once";
  EXPECT_EQ(fault_of(source->wait(1s)), FaultKind::kNotStarted);
  EXPECT_EQ(std::get<Frame>(held).bytes()[0], 0) << "still readable";
  EXPECT_EQ(source->start().error().kind, FaultKind::kNotFound);
  kernel_->is_plugged = true;
  ASSERT_TRUE(source->start());
  kernel_->frames = {grey_frame(900)};
  EXPECT_EQ(std::get<Frame>(source->wait(1s)).info().sequence, 0U);
}

TEST_F(V4l2SourceTest, UnplugWhileWaitingIsSeen) {
  const auto source = make();
  ASSERT_TRUE(source->start());
  kernel_->poll_events = POLLERR;
  EXPECT_EQ(fault_of(source->wait(1s)), FaultKind::kIo) << "an error that the driver hides";
  kernel_->poll_events = 0;
  ASSERT_TRUE(source->start());
  kernel_->errors[VIDIOC_DQBUF] = EIO;
  EXPECT_EQ(fault_of(source->wait(1s)), FaultKind::kIo);
  EXPECT_TRUE(kernel_->open_fds.empty());
}

TEST_F(V4l2SourceTest, DoesNotStartWithoutASignal) {
  kernel_->has_inputs = true;
  kernel_->input_status = V4L2_IN_ST_NO_SIGNAL;
  const auto source = make();
  const auto started = source->start();
  ASSERT_FALSE(started);
  EXPECT_EQ(started.error().kind, FaultKind::kNoSignal);
  EXPECT_TRUE(kernel_->open_fds.empty());
  kernel_->input_status = 0;
  EXPECT_TRUE(source->start());
}

TEST_F(V4l2SourceTest, TellsThatTheSignalWentAway) {
  kernel_->has_inputs = true;
  const auto source = make();
  ASSERT_TRUE(source->start());
  kernel_->input_status = V4L2_IN_ST_NO_SYNC;
  kernel_->signal_changes = 2;
  EXPECT_EQ(fault_of(source->wait(1s)), FaultKind::kNoSignal);
  EXPECT_TRUE(kernel_->open_fds.empty()) << "the stream has ended";
}

TEST_F(V4l2SourceTest, GoesOnWhenTheSignalChangesAndIsThere) {
  kernel_->has_inputs = true;
  const auto source = make();
  ASSERT_TRUE(source->start());
  kernel_->signal_changes = 1;
  EXPECT_EQ(fault_of(source->wait(1s)), FaultKind::kTimeout);
  EXPECT_EQ(kernel_->signal_changes, 0);
  kernel_->frames = {grey_frame(0)};
  EXPECT_TRUE(std::holds_alternative<Frame>(source->wait(1s)));
}

TEST_F(V4l2SourceTest, FramesOutliveTheSource) {
  auto source = make();
  ASSERT_TRUE(source->start());
  kernel_->frames = {grey_frame(5)};
  const FrameEvent event = source->wait(1s);
  source.reset();
  EXPECT_TRUE(kernel_->open_fds.empty());
  EXPECT_EQ(kernel_->mappings.size(), 1U);
  EXPECT_EQ(std::get<Frame>(event).bytes()[31], 5);
}

TEST_F(V4l2SourceTest, ABufferThatTheDriverRefusesIsOfferedAgain) {
  const auto source = make();
  ASSERT_TRUE(source->start());
  kernel_->frames = {grey_frame(0), grey_frame(1)};
  {
    const FrameEvent event = source->wait(1s);
    kernel_->errors[VIDIOC_QBUF] = EINVAL;
  }
  EXPECT_EQ(kernel_->queued, 3U);
  kernel_->errors.clear();
  EXPECT_TRUE(std::holds_alternative<Frame>(source->wait(1s)));
  EXPECT_EQ(kernel_->queued, 4U);
}

TEST_F(V4l2SourceTest, AStopRequestEndsTheWait) {
  const auto source = make();
  ASSERT_TRUE(source->start());
  source->request_stop();
  EXPECT_TRUE(std::holds_alternative<WaitStopped>(source->wait(1h)));
}

TEST_F(V4l2SourceTest, RefusesADriverWithOneBuffer) {
  kernel_->most_buffers = 1;
  const auto source = make();
  const auto started = source->start();
  ASSERT_FALSE(started);
  EXPECT_THAT(started.error().message, HasSubstr("1 of 4 frame buffers"));
}

TEST_F(V4l2SourceTest, ClosesEverythingWhereverTheStartFails) {
  {
    const auto source = make();
    ASSERT_TRUE(source->start());
  }
  const std::size_t calls = kernel_->calls.size();
  std::size_t failures = 0;
  for (const int error : {EIO, ENODEV, EBUSY, EACCES, ENOMEM, EINVAL}) {
    for (std::size_t nth = 1; nth <= calls; ++nth) {
      const auto source = make();
      kernel_->nth_ioctl = static_cast<int>(nth);
      kernel_->nth_error = error;
      const auto started = source->start();
      if (!started) {
        ++failures;
        EXPECT_FALSE(started.error().message.empty());
        EXPECT_TRUE(kernel_->open_fds.empty()) << "call " << nth << " error " << error;
        EXPECT_TRUE(kernel_->mappings.empty()) << "call " << nth << " error " << error;
      }
      source->stop();
      kernel_->nth_ioctl = 0;
      ASSERT_TRUE(source->start()) << "call " << nth << " error " << error;
    }
  }
  EXPECT_GT(failures, 6U * 8U);
  kernel_->map_error = ENOMEM;
  EXPECT_FALSE(make()->start());
}

TEST_F(V4l2SourceTest, SurvivesAnErrorAtEveryCallOfAStream) {
  for (std::size_t nth = 1; nth <= 12; ++nth) {
    for (const int error : {EIO, ENODEV, EINVAL, EAGAIN}) {
      const auto source = make();
      ASSERT_TRUE(source->start());
      kernel_->frames = {grey_frame(0), grey_frame(1), grey_frame(2), grey_frame(3)};
      kernel_->nth_ioctl = static_cast<int>(nth);
      kernel_->nth_error = error;
      for (int i = 0; i < 4; ++i) {
        const FrameEvent event = source->wait(0ns);
        EXPECT_FALSE(std::holds_alternative<EndOfFrames>(event));
      }
      source->stop();
      kernel_->nth_ioctl = 0;
      kernel_->frames.clear();
      ASSERT_TRUE(kernel_->open_fds.empty());
      ASSERT_TRUE(kernel_->mappings.empty());
    }
  }
}

TEST(V4l2Options, NamesWhatIsWrong) {
  V4l2Options options;
  EXPECT_TRUE(options.validate());
  options.wish.rate_hz = 0.0;
  EXPECT_FALSE(options.validate());
  options = {};
  options.wish.format = PixelFormat::kPng;
  EXPECT_THAT(options.validate().error().message, HasSubstr("PNG"));
  options = {};
  options.buffer_count = 1;
  EXPECT_THAT(options.validate().error().message, HasSubstr("buffer_count is 1"));
}

}  // namespace
}  // namespace trigmesh
