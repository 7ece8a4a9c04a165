#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <vector>

#include <poll.h>

#include "drivers/camera/frame_source.hpp"
#include "drivers/camera/slot_pool.hpp"
#include "drivers/device/wake_event.hpp"
#include "firmware/base/clock.hpp"
#include "tests/unit/firmware/daemon/test_frames.hpp"

namespace trigmesh::test_support {

/// The hand on a LiveCamera. Thread-safe.
struct LiveCameraHand {
  std::atomic<bool> is_plugged = true;
  std::atomic<bool> is_hanging = false;  ///< a wait does not return
  std::atomic<std::uint64_t> frames = 0;
  std::atomic<std::uint64_t> starts = 0;
};

/// A camera that runs by the clock: a grey frame every few milliseconds, exposed at its timestamp.
/// It can be unplugged, and made to hang.
class LiveCamera final : public FrameSource {
 public:
  static constexpr std::chrono::milliseconds kInterval{4};

  LiveCamera(std::shared_ptr<LiveCameraHand> hand, const Clock& clock)
      : hand_(std::move(hand)),
        clock_(clock),
        pool_(std::make_shared<SlotPool>(4, nullptr)),
        bytes_(grey_lines(50)) {}

  DeviceResult<> start() override {
    ++hand_->starts;
    if (!hand_->is_plugged) {
      return device_fault(FaultKind::kNotFound, "no such camera");
    }
    is_running_ = true;
    sequence_ = 0;
    due_ = clock_.now() + kInterval;
    return {};
  }

  void stop() override {
    is_running_ = false;
    stop_requested_.clear();
  }

  FrameEvent wait(std::chrono::nanoseconds timeout) override {
    while (hand_->is_hanging && !stop_requested_.is_set()) {
      pause(std::chrono::milliseconds(1));
    }
    if (stop_requested_.is_set()) {
      return WaitStopped{};
    }
    if (!is_running_ || !hand_->is_plugged) {
      is_running_ = false;
      return DeviceFault{FaultKind::kDisconnected, "the camera was unplugged"};
    }
    const std::chrono::nanoseconds left = due_ - clock_.now();
    pause(std::min(left, timeout));
    if (stop_requested_.is_set()) {
      return WaitStopped{};
    }
    if (left > timeout) {
      return DeviceFault{FaultKind::kTimeout, "no frame in time"};
    }
    return frame();
  }

  void request_stop() noexcept override { stop_requested_.set(); }

  SourceInfo info() const override {
    SourceInfo info;
    info.frame_interval = kInterval;
    return info;
  }

  FrameCounters counters() const override { return {}; }

 private:
  void pause(std::chrono::nanoseconds time) {
    pollfd entry{stop_requested_.fd(), POLLIN, 0};
    (void)poll_until({&entry, 1}, time, clock_);
  }

  FrameEvent frame() {
    FrameInfo info;
    info.timestamp = clock_.now();
    info.sequence = sequence_++;
    info.layout.format = PixelFormat::kGrey;
    info.layout.width_px = 64;
    info.layout.height_px = 48;
    info.layout.stride_bytes = 64;
    due_ = clock_.now() + kInterval;
    const auto slot = pool_->take();
    if (!slot) {
      return DeviceFault{FaultKind::kTimeout, "all buffers are out"};
    }
    pool_->bytes(*slot).assign(bytes_.begin(), bytes_.end());
    ++hand_->frames;
    return Frame(info, pool_->bytes(*slot), pool_, *slot);
  }

  const std::shared_ptr<LiveCameraHand> hand_;  // shared with the test
  const Clock& clock_;
  const std::shared_ptr<SlotPool> pool_;
  const std::vector<std::uint8_t> bytes_;
  WakeEvent stop_requested_;
  bool is_running_ = false;
  std::uint64_t sequence_ = 0;
  std::chrono::nanoseconds due_{};
};

}  // namespace trigmesh::test_support
