#include <chrono>
#include <iostream>
#include <optional>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "drivers/camera/frame_source.hpp"
#include "tests/conformance/allocation_counter.hpp"
#include "tests/conformance/camera_backend.hpp"

namespace trigmesh::conformance {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;

/// A device needs time for its first frame; only a broken one needs all of it.
constexpr nanoseconds kPatience = 20s;

class CameraConformance : public ::testing::TestWithParam<CameraBackend> {
 protected:
  [[nodiscard]] static std::unique_ptr<FrameSource> make(std::size_t frame_count) {
    return GetParam().make({frame_count});
  }

  /// The next frame; test fails on anything else. Damaged frames of a real device are passed over.
  [[nodiscard]] static Frame next(FrameSource& source) {
    while (true) {
      FrameEvent event = source.wait(kPatience);
      if (auto* frame = std::get_if<Frame>(&event)) {
        return std::move(*frame);
      }
      const auto* fault = std::get_if<DeviceFault>(&event);
      if (fault == nullptr || fault_policy(fault->kind).action != FaultAction::kContinue) {
        ADD_FAILURE() << "no frame: " << (fault != nullptr ? fault->message : "end or stop");
        return {};
      }
    }
  }

  static std::optional<FaultKind> fault_of(const FrameEvent& event) {
    const auto* fault = std::get_if<DeviceFault>(&event);
    return fault != nullptr ? std::optional(fault->kind) : std::nullopt;
  }
};

TEST_P(CameraConformance, DeliversFramesInOrder) {
  constexpr std::size_t kCount = 20;
  const auto source = make(kCount);
  const auto started = source->start();
  ASSERT_TRUE(started) << started.error().message;
  std::optional<nanoseconds> last_time;
  std::optional<std::uint64_t> last_sequence;
  std::uint64_t missed = 0;
  for (std::size_t i = 0; i < kCount; ++i) {
    const Frame frame = next(*source);
    ASSERT_FALSE(frame.empty());
    EXPECT_FALSE(frame.bytes().empty());
    EXPECT_GE(frame.bytes().size(), needed_bytes(frame.info().layout));
    ASSERT_TRUE(frame.info().timestamp);
    EXPECT_TRUE(!last_time || *last_time < *frame.info().timestamp);
    EXPECT_TRUE(!last_sequence ||
                frame.info().sequence > *last_sequence + frame.info().missed_before);
    last_time = frame.info().timestamp;
    last_sequence = frame.info().sequence;
    missed += frame.info().missed_before;
  }
  EXPECT_EQ(source->counters().frames, kCount);
  EXPECT_EQ(source->counters().missed, missed);
  EXPECT_FALSE(source->info().stable_name.empty());
  EXPECT_GT(source->info().buffer_count, 0U);
}

TEST_P(CameraConformance, StartsAndStopsAgainAndAgain) {
  const auto source = make(10);
  source->stop();
  for (int round = 0; round < 3; ++round) {
    ASSERT_TRUE(source->start()) << round;
    ASSERT_TRUE(source->start()) << "twice is once";
    EXPECT_FALSE(next(*source).empty()) << round;
    source->stop();
    source->stop();
  }
}

TEST_P(CameraConformance, SaysThatItIsNotStarted) {
  const auto source = make(10);
  EXPECT_EQ(fault_of(source->wait(kPatience)), FaultKind::kNotStarted);
  ASSERT_TRUE(source->start());
  source->stop();
  EXPECT_EQ(fault_of(source->wait(kPatience)), FaultKind::kNotStarted);
}

TEST_P(CameraConformance, HonoursTheTimeout) {
  if (!GetParam().is_scripted) {
    GTEST_SKIP() << GetParam().name << " cannot be asked to be silent";
  }
  const auto source = make(1);
  ASSERT_TRUE(source->start());
  EXPECT_FALSE(next(*source).empty());
  EXPECT_EQ(fault_of(source->wait(0ns)), FaultKind::kTimeout);
  EXPECT_EQ(fault_of(source->wait(-1ns)), FaultKind::kTimeout);
  EXPECT_EQ(fault_of(source->wait(3ms)), FaultKind::kTimeout);
  EXPECT_EQ(source->counters().faults.of(FaultKind::kTimeout), 3U);
}

TEST_P(CameraConformance, AStopRequestEndsABlockedWait) {
  const auto source = make(1);
  ASSERT_TRUE(source->start());
  std::jthread asker([&source] { source->request_stop(); });
  // Without the request this would wait for ever: the time-out of the test is the assertion.
  bool is_stopped = false;
  while (!is_stopped) {
    const FrameEvent event = source->wait(nanoseconds::max());
    is_stopped = std::holds_alternative<WaitStopped>(event);
    ASSERT_TRUE(is_stopped || std::holds_alternative<Frame>(event));
  }
  EXPECT_TRUE(std::holds_alternative<WaitStopped>(source->wait(0ns))) << "it lasts until stop()";
}

TEST_P(CameraConformance, AStopRequestBeforeTheStartIsNotLostAndStopForgetsIt) {
  const auto source = make(5);
  source->request_stop();
  ASSERT_TRUE(source->start());
  EXPECT_TRUE(std::holds_alternative<WaitStopped>(source->wait(kPatience)));
  source->stop();
  ASSERT_TRUE(source->start());
  EXPECT_FALSE(next(*source).empty());
}

TEST_P(CameraConformance, BuffersGoRoundAsLongAsTheyComeBack) {
  const auto source = make(60);
  ASSERT_TRUE(source->start());
  for (int i = 0; i < 60; ++i) {
    ASSERT_FALSE(next(*source).empty()) << i;
  }
}

TEST_P(CameraConformance, NeverHandsOutMoreFramesThanItHasBuffers) {
  if (!GetParam().is_scripted) {
    GTEST_SKIP() << GetParam().name << " runs on while its buffers are out";
  }
  const auto source = make(30);
  ASSERT_TRUE(source->start());
  std::vector<Frame> held;
  const std::size_t buffer_count = source->info().buffer_count;
  for (std::size_t i = 0; i < buffer_count; ++i) {
    held.push_back(next(*source));
  }
  EXPECT_EQ(fault_of(source->wait(0ns)), FaultKind::kTimeout);
  held.clear();
  if (!GetParam().loses_frames) {
    EXPECT_EQ(next(*source).info().sequence, buffer_count);
  }
}

TEST_P(CameraConformance, FramesStayReadableWhenTheSourceStopsAndGoes) {
  auto source = make(6);
  ASSERT_TRUE(source->start());
  const Frame first = next(*source);
  Frame second = next(*source);
  const std::vector<std::uint8_t> copy(first.bytes().begin(), first.bytes().end());
  source->stop();
  EXPECT_TRUE(std::equal(copy.begin(), copy.end(), first.bytes().begin(), first.bytes().end()));
  ASSERT_TRUE(source->start()) << "also while frames of the last stream are out";
  EXPECT_FALSE(next(*source).empty());
  second.release();
  source.reset();
  EXPECT_TRUE(std::equal(copy.begin(), copy.end(), first.bytes().begin(), first.bytes().end()));
}

TEST_P(CameraConformance, FramesMayBeReleasedOnAnotherThread) {
  const auto source = make(40);
  ASSERT_TRUE(source->start());
  for (int i = 0; i < 40; ++i) {
    Frame frame = next(*source);
    ASSERT_FALSE(frame.empty()) << i;
    std::jthread([&frame] { frame.release(); }).join();
  }
}

TEST_P(CameraConformance, TakesNoMemoryInSteadyState) {
  constexpr int kWarmUp = 30;
  constexpr int kMeasured = 100;
  const auto source = make(kWarmUp + kMeasured);
  ASSERT_TRUE(source->start());
  for (int i = 0; i < kWarmUp; ++i) {
    ASSERT_FALSE(next(*source).empty());
  }
  const std::optional<std::uint64_t> before = allocations_of_this_thread();
  if (!before) {
    GTEST_SKIP() << "the sanitizer of this build has replaced operator new";
  }
  for (int i = 0; i < kMeasured; ++i) {
    ASSERT_FALSE(next(*source).empty());
  }
  EXPECT_EQ(allocations_of_this_thread(), before);
}

INSTANTIATE_TEST_SUITE_P(Backends,
                         CameraConformance,
                         ::testing::ValuesIn(camera_backends().running),
                         [](const auto& test) { return test.param.name; });

TEST(CameraBackends, SaysWhichWereSkipped) {
  const CameraBackends& backends = camera_backends();
  std::cout << backends.running.size() << " camera backends tested, " << backends.skipped.size()
            << " skipped\n";
  for (const std::string& reason : backends.skipped) {
    std::cout << "skipped: " << reason << '\n';
  }
  EXPECT_GE(backends.running.size(), 2U);
}

}  // namespace
}  // namespace trigmesh::conformance
