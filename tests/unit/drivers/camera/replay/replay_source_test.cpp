#include "drivers/camera/replay/replay_source.hpp"

#include <fstream>
#include <string>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/manual_clock.hpp"
#include "tests/support/temporary_folder.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using ::testing::HasSubstr;

class ReplaySourceTest : public ::testing::Test {
 protected:
  void write(const std::string& name, const std::string& content) const {
    fs::create_directories((root_ / name).parent_path());
    std::ofstream(root_ / name, std::ios::binary) << content;
  }

  void write_three() const {
    write("images/a.jpg", "one");
    write("images/b.png", "two");
    write("images/c.jpg", "three");
    write("timestamps.csv", "name,timestamp_ns\na.jpg,500\nb.png,600\nc.jpg,900\n");
  }

  [[nodiscard]] std::unique_ptr<ReplaySource> open(const ReplayOptions& options = {}) const {
    auto recording = Recording::open(root_);
    EXPECT_TRUE(recording) << recording.error().message;
    auto source = ReplaySource::create(*std::move(recording), options, clock_);
    EXPECT_TRUE(source) << source.error().message;
    return *std::move(source);
  }

  static std::string text_of(const FrameEvent& event) {
    if (const auto* frame = std::get_if<Frame>(&event)) {
      return {frame->bytes().begin(), frame->bytes().end()};
    }
    const auto* fault = std::get_if<DeviceFault>(&event);
    return fault != nullptr ? std::string(to_string(fault->kind)) : "no frame, no fault";
  }

  const test_support::TemporaryFolder temporary_;
  const fs::path root_ = temporary_.path();
  test_support::ManualClock clock_;
};

TEST_F(ReplaySourceTest, DeliversBytesNamesAndTimesAsRecorded) {
  write_three();
  const auto source = open();
  ASSERT_TRUE(source->start());
  EXPECT_EQ(text_of(source->wait(nanoseconds(0))), "one");
  const FrameEvent event = source->wait(nanoseconds(0));
  const FrameInfo& info = std::get<Frame>(event).info();
  EXPECT_EQ(info.name, "b.png");
  EXPECT_EQ(info.timestamp, nanoseconds(600));
  EXPECT_EQ(info.moment, FrameMoment::kExposureMiddle);
  EXPECT_EQ(info.sequence, 1U);
  EXPECT_EQ(info.layout.format, PixelFormat::kPng);
  EXPECT_EQ(text_of(source->wait(nanoseconds(0))), "three");
  EXPECT_TRUE(std::holds_alternative<EndOfFrames>(source->wait(nanoseconds(0))));
  EXPECT_EQ(source->counters().frames, 3U);
  EXPECT_EQ(source->info().frame_interval, nanoseconds(200));
}

TEST_F(ReplaySourceTest, NamesOutliveTheSource) {
  write_three();
  auto source = open();
  ASSERT_TRUE(source->start());
  const FrameEvent event = source->wait(nanoseconds(0));
  source.reset();
  EXPECT_EQ(std::get<Frame>(event).info().name, "a.jpg");
  EXPECT_EQ(text_of(event), "one");
}

TEST_F(ReplaySourceTest, GoesOnAfterAFrameThatCannotBeRead) {
  write("images/a.jpg", "first");
  write("images/c.jpg", "third");
  write("images/d.jpg", "");
  write("timestamps.csv", "name,timestamp_ns\na.jpg,1\nb.jpg,2\nc.jpg,3\nd.jpg,4\n");
  const auto source = open();
  ASSERT_TRUE(source->start());
  EXPECT_EQ(text_of(source->wait(nanoseconds(0))), "first");
  EXPECT_EQ(text_of(source->wait(nanoseconds(0))), "corrupt frame");
  const FrameEvent third = source->wait(nanoseconds(0));
  EXPECT_EQ(text_of(third), "third");
  EXPECT_EQ(std::get<Frame>(third).info().sequence, 2U);
  EXPECT_EQ(text_of(source->wait(nanoseconds(0))), "short frame");
  EXPECT_TRUE(std::holds_alternative<EndOfFrames>(source->wait(nanoseconds(0))));
}

TEST_F(ReplaySourceTest, AtRecordedSpeedAFrameComesWhenItIsDue) {
  write_three();
  const auto source = open({.pace = ReplayPace::kRecordedSpeed});
  ASSERT_TRUE(source->start());
  EXPECT_EQ(text_of(source->wait(nanoseconds(0))), "one");
  EXPECT_EQ(text_of(source->wait(nanoseconds(0))), "timeout");
  clock_.time += nanoseconds(99);
  EXPECT_EQ(text_of(source->wait(nanoseconds(0))), "timeout");
  clock_.time += nanoseconds(1);
  EXPECT_EQ(text_of(source->wait(nanoseconds(0))), "two");
  clock_.time += milliseconds(5);
  EXPECT_EQ(text_of(source->wait(nanoseconds(0))), "three") << "late, but not lost";
}

TEST_F(ReplaySourceTest, InLockStepTheNextFrameComesWhenTheLastIsReleased) {
  write_three();
  const auto source = open({.pace = ReplayPace::kLockStep});
  ASSERT_TRUE(source->start());
  FrameEvent held = source->wait(nanoseconds(0));
  EXPECT_EQ(text_of(source->wait(nanoseconds(0))), "timeout");
  std::get<Frame>(held).release();
  EXPECT_EQ(text_of(source->wait(nanoseconds(0))), "two");
}

TEST_F(ReplaySourceTest, WaitsForABufferAndLosesNothing) {
  write_three();
  const auto source = open({.buffer_count = 2});
  ASSERT_TRUE(source->start());
  FrameEvent first = source->wait(nanoseconds(0));
  const FrameEvent second = source->wait(nanoseconds(0));
  EXPECT_EQ(text_of(source->wait(nanoseconds(0))), "timeout");
  first = WaitStopped{};
  EXPECT_EQ(text_of(source->wait(nanoseconds(0))), "three");
  EXPECT_EQ(text_of(second), "two");
}

TEST_F(ReplaySourceTest, BeginsAgainAfterAStop) {
  write_three();
  const auto source = open();
  ASSERT_TRUE(source->start());
  EXPECT_EQ(text_of(source->wait(nanoseconds(0))), "one");
  EXPECT_EQ(text_of(source->wait(nanoseconds(0))), "two");
  source->stop();
  EXPECT_EQ(text_of(source->wait(nanoseconds(0))), "not started");
  ASSERT_TRUE(source->start());
  EXPECT_EQ(text_of(source->wait(nanoseconds(0))), "one");
}

TEST_F(ReplaySourceTest, RefusesASpeedThatWasNotRecorded) {
  write("a.jpg", "pixels");
  auto recording = Recording::open(root_);
  ASSERT_TRUE(recording);
  const auto source =
      ReplaySource::create(*std::move(recording), {.pace = ReplayPace::kRecordedSpeed}, clock_);
  ASSERT_FALSE(source);
  EXPECT_EQ(source.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(source.error().message, HasSubstr("no timestamps.csv"));
  auto again = Recording::open(root_);
  ASSERT_TRUE(again);
  EXPECT_EQ(ReplaySource::create(*std::move(again), {.buffer_count = 0}, clock_).error().code,
            ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace trigmesh
