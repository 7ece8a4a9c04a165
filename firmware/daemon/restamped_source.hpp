#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>

#include "drivers/camera/frame_source.hpp"
#include "firmware/base/clock.hpp"

namespace trigmesh {

/// How the times of a recording become times of now.
enum class Restamping : std::uint8_t {
  kShifted,    ///< recorded speed: the first frame is now, the others as long after it as they were
  kDelivered,  ///< any other speed: when the frame was delivered
};

/// A recording that stands for a camera: its frames get times of the machine's monotonic clock, or
/// they could not be compared with presses. Everything else is the source's.
class RestampedSource final : public FrameSource {
 public:
  /// `clock` outlives it.
  RestampedSource(std::unique_ptr<FrameSource> source, Restamping restamping, const Clock& clock)
      : source_(std::move(source)), restamping_(restamping), clock_(clock) {}

  [[nodiscard]] DeviceResult<> start() override {
    first_time_.reset();
    started_ = clock_.now();
    return source_->start();
  }

  void stop() override { source_->stop(); }

  [[nodiscard]] FrameEvent wait(std::chrono::nanoseconds timeout) override;

  void request_stop() noexcept override { source_->request_stop(); }

  [[nodiscard]] SourceInfo info() const override { return source_->info(); }

  [[nodiscard]] FrameCounters counters() const override { return source_->counters(); }

  [[nodiscard]] CameraControls* controls() override { return source_->controls(); }

 private:
  const std::unique_ptr<FrameSource> source_;
  const Restamping restamping_;
  const Clock& clock_;
  std::chrono::nanoseconds started_{};
  std::optional<std::chrono::nanoseconds> first_time_;  ///< in the recording
};

}  // namespace trigmesh
