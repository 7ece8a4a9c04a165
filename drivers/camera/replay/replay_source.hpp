#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "drivers/camera/frame_source.hpp"
#include "drivers/camera/replay/recording.hpp"
#include "drivers/camera/slot_pool.hpp"
#include "drivers/device/wake_event.hpp"
#include "firmware/base/clock.hpp"

namespace trigmesh {

/// When the next frame of a recording is due. Every frame is delivered, in order, whatever the
/// pace.
enum class ReplayPace {
  kAsFastAsPossible,  ///< at once, while buffers are free
  kRecordedSpeed,     ///< not before its time since the first frame; late consumers lose nothing
  kLockStep,          ///< when the frame before it was released: one frame in the house at a time
};

struct ReplayOptions {
  ReplayPace pace = ReplayPace::kAsFastAsPossible;
  /// Frames that may be held at once. > 0.
  std::size_t buffer_count = 4;

  [[nodiscard]] Result<> validate() const;
};

/// The frames of a recording one after the other, their bytes as they lie in the files. A file that
/// cannot be read is kCorruptFrame (kShortFrame when empty) in its place, and the rest goes on.
class ReplaySource final : public FrameSource {
 public:
  /// `clock` is used for the pace and time-outs and outlives the source. kInvalidArgument: options,
  /// or recorded speed of frames without timestamps; kIo: the system has no descriptors left.
  [[nodiscard]] static Result<std::unique_ptr<ReplaySource>> create(Recording recording,
                                                                    const ReplayOptions& options,
                                                                    const Clock& clock);

  /// The first frame again when it was stopped.
  [[nodiscard]] DeviceResult<> start() override;
  void stop() override;
  [[nodiscard]] FrameEvent wait(std::chrono::nanoseconds timeout) override;

  void request_stop() noexcept override { stop_requested_.set(); }

  [[nodiscard]] SourceInfo info() const override;

  [[nodiscard]] FrameCounters counters() const override { return counters_; }

 private:
  ReplaySource(std::shared_ptr<const Recording> recording,
               const ReplayOptions& options,
               const Clock& clock);

  [[nodiscard]] std::chrono::nanoseconds due_time() const;
  [[nodiscard]] std::optional<std::size_t> take_slot();
  [[nodiscard]] FrameEvent deliver(std::size_t slot);
  [[nodiscard]] FrameEvent refuse(DeviceFault fault);

  const std::shared_ptr<const Recording> recording_;  // shared with the frames, which name it
  const ReplayOptions options_;
  const Clock& clock_;
  const std::shared_ptr<SlotPool> pool_;
  WakeEvent stop_requested_;
  bool is_running_ = false;
  std::size_t next_index_ = 0;
  std::chrono::nanoseconds start_time_{0};
  FrameCounters counters_;
};

}  // namespace trigmesh
