#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "drivers/camera/camera_mode.hpp"
#include "drivers/camera/frame_sequence.hpp"
#include "drivers/camera/frame_source.hpp"
#include "drivers/camera/v4l2/kernel.hpp"
#include "drivers/camera/v4l2/mapped_buffers.hpp"
#include "drivers/camera/v4l2/v4l2_controls.hpp"
#include "drivers/device/wake_event.hpp"
#include "firmware/base/clock.hpp"

namespace trigmesh {

struct V4l2Options {
  /// A stable name as list_cameras gives it, a path below /dev, or empty for the first camera.
  /// After the first start() the stable name of that camera is used.
  std::string camera;
  CameraWish wish;
  /// Frame buffers to ask for, [2, 32]. Those that frames hold are not there for the driver.
  std::size_t buffer_count = 6;

  [[nodiscard]] Result<> validate() const;
};

/// A camera through the kernel's V4L2 interface: a USB camera, or whatever else has a video node
/// that streams in one plane. Frames lie in the memory that the driver writes.
class V4l2Source final : public FrameSource {
 public:
  /// Opens nothing yet. `clock` is that of the kernel's timestamps (SteadyClock) and outlives the
  /// source; `kernel` is shared with frames that outlive it. kInvalidArgument: options; kIo: the
  /// system has no descriptors left.
  [[nodiscard]] static Result<std::unique_ptr<V4l2Source>> create(V4l2Options options,
                                                                  std::shared_ptr<Kernel> kernel,
                                                                  const Clock& clock);

  ~V4l2Source() override { stop(); }

  V4l2Source(const V4l2Source&) = delete;
  V4l2Source& operator=(const V4l2Source&) = delete;
  V4l2Source(V4l2Source&&) = delete;
  V4l2Source& operator=(V4l2Source&&) = delete;

  /// kNotFound, kPermission, kBusy, kNoSignal, kFormatRefused; kControlRefused when a lock of the
  /// session cannot be restored; kDisconnected and kIo when it fails on the way.
  [[nodiscard]] DeviceResult<> start() override;
  void stop() override;
  [[nodiscard]] FrameEvent wait(std::chrono::nanoseconds timeout) override;

  void request_stop() noexcept override { stop_requested_.set(); }

  [[nodiscard]] SourceInfo info() const override { return info_; }

  [[nodiscard]] FrameCounters counters() const override { return counters_; }

  [[nodiscard]] CameraControls* controls() override { return &controls_; }

 private:
  V4l2Source(V4l2Options options, std::shared_ptr<Kernel> kernel, const Clock& clock);

  [[nodiscard]] DeviceResult<> open_and_start();
  /// Nothing when there is no frame yet.
  [[nodiscard]] std::optional<FrameEvent> take();
  [[nodiscard]] FrameEvent deliver(const FilledBuffer& filled);
  void stamp(const FilledBuffer& filled, FrameInfo& info);
  /// Nothing when it is worth looking for a frame.
  [[nodiscard]] std::optional<FrameEvent> wait_for_device(std::chrono::nanoseconds deadline);
  /// A fault when the driver tells that its input has lost the signal.
  [[nodiscard]] std::optional<FrameEvent> look_at_signal();
  [[nodiscard]] FrameEvent refuse(DeviceFault fault);
  [[nodiscard]] DeviceFault silence() const;

  V4l2Options options_;
  const std::shared_ptr<Kernel> kernel_;
  const Clock& clock_;
  V4l2Controls controls_;
  WakeEvent stop_requested_;
  std::shared_ptr<MappedBuffers> buffers_;  ///< shared with frames; nothing when stopped
  SourceInfo info_;
  FrameSequence sequence_;
  std::uint64_t missed_ = 0;  ///< since the last frame that was delivered
  std::optional<std::chrono::nanoseconds> last_timestamp_;
  FrameCounters counters_;
};

}  // namespace trigmesh
