#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "drivers/camera/frame_source.hpp"
#include "drivers/camera/slot_pool.hpp"
#include "drivers/device/wake_event.hpp"
#include "firmware/base/clock.hpp"

namespace trigmesh {

/// The mock camera exposes a frame.
struct MockFrame {
  std::vector<std::uint8_t> bytes;
  FrameLayout layout;
  std::optional<std::chrono::nanoseconds> timestamp;
  std::uint64_t lost_before = 0;  ///< frames that the mock loses before this one
};

/// The mock camera fails.
struct MockFault {
  FaultKind kind = FaultKind::kIo;
};

/// The mock camera says nothing for as long as one wait lasts.
struct MockSilence {};

/// The mock camera has no more frames, like a recording. Without it, it is silent for ever.
struct MockEnd {};

using MockStep = std::variant<MockFrame, MockFault, MockSilence, MockEnd>;

/// What a mock camera does, in order.
struct MockScript {
  std::vector<MockStep> steps;
  /// One entry a call of start(): the fault that it meets, or nothing. Calls beyond them succeed.
  std::vector<std::optional<FaultKind>> starts;
  std::size_t buffer_count = 4;  ///< > 0
  SourceInfo info;               ///< buffer_count is filled in
};

/// A camera that is none: frames and faults from a script, for tests of what stands above. Like a
/// camera, it loses the frames for which no buffer is free; stopped and started again, it goes on
/// with the next step.
class MockFrameSource final : public FrameSource {
 public:
  /// `clock` outlives the source; only its time-outs use it.
  MockFrameSource(MockScript script, const Clock& clock);

  [[nodiscard]] DeviceResult<> start() override;
  void stop() override;
  [[nodiscard]] FrameEvent wait(std::chrono::nanoseconds timeout) override;

  void request_stop() noexcept override { stop_requested_.set(); }

  [[nodiscard]] SourceInfo info() const override { return script_->info; }

  [[nodiscard]] FrameCounters counters() const override { return counters_; }

  /// Frames that somebody holds.
  [[nodiscard]] std::size_t frames_out() const { return pool_->out_count(); }

  /// Calls of start() that were made.
  [[nodiscard]] std::size_t start_count() const { return start_count_; }

 private:
  [[nodiscard]] std::optional<FrameEvent> play(const MockFrame& step);
  [[nodiscard]] FrameEvent play(const MockFault& step);
  [[nodiscard]] FrameEvent stay_silent(std::chrono::nanoseconds timeout);
  [[nodiscard]] FrameEvent refuse(FaultKind kind, std::string message);

  const std::shared_ptr<const MockScript> script_;  // shared with the pool, which frames keep
  const Clock& clock_;
  const std::shared_ptr<SlotPool> pool_;
  WakeEvent stop_requested_;
  bool is_running_ = false;
  std::size_t next_step_ = 0;
  std::size_t start_count_ = 0;
  std::uint64_t next_sequence_ = 0;
  std::uint64_t missed_ = 0;  ///< since the last frame
  FrameCounters counters_;
};

}  // namespace trigmesh
