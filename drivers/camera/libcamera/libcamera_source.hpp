#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "drivers/camera/camera_mode.hpp"
#include "drivers/camera/frame_sequence.hpp"
#include "drivers/camera/frame_source.hpp"
#include "drivers/camera/libcamera/camera_hub.hpp"
#include "drivers/camera/libcamera/camera_stream.hpp"
#include "drivers/camera/libcamera/libcamera_controls.hpp"
#include "drivers/device/wake_event.hpp"
#include "firmware/base/clock.hpp"

namespace trigmesh {

struct LibcameraOptions {
  /// A stable name as list_libcamera_cameras() gives it, or empty for the first camera. After the
  /// first start() the stable name of that camera is used.
  std::string camera;
  CameraWish wish;
  CameraUse use = CameraUse::kVideo;
  /// Frame buffers to ask for, [3, 32]: two at the camera, one at a frame.
  std::size_t buffer_count = 6;

  [[nodiscard]] Result<> validate() const;
};

/// A camera through libcamera: sensors of boards, whose pictures pass an image processor that has
/// to be set up and tuned. Frames lie in the memory that the device writes.
class LibcameraSource final : public FrameSource {
 public:
  /// Opens nothing yet. `clock` is CLOCK_MONOTONIC (SteadyClock) and outlives the source.
  /// kInvalidArgument: options; kIo: the system has no descriptors left.
  [[nodiscard]] static Result<std::unique_ptr<LibcameraSource>> create(LibcameraOptions options,
                                                                       const Clock& clock);

  ~LibcameraSource() override { stop(); }

  LibcameraSource(const LibcameraSource&) = delete;
  LibcameraSource& operator=(const LibcameraSource&) = delete;
  LibcameraSource(LibcameraSource&&) = delete;
  LibcameraSource& operator=(LibcameraSource&&) = delete;

  /// kNotFound, kBusy, kFormatRefused; kControlRefused when a lock of the session cannot be
  /// restored; kTimeout when it has to be and no frame comes; kDisconnected and kIo when it fails
  /// on the way.
  [[nodiscard]] DeviceResult<> start() override;
  void stop() override;
  [[nodiscard]] FrameEvent wait(std::chrono::nanoseconds timeout) override;

  void request_stop() noexcept override { stop_requested_.set(); }

  [[nodiscard]] SourceInfo info() const override { return info_; }

  [[nodiscard]] FrameCounters counters() const override { return counters_; }

  [[nodiscard]] CameraControls* controls() override { return &controls_; }

 private:
  LibcameraSource(LibcameraOptions options, const Clock& clock);

  [[nodiscard]] DeviceResult<> open_and_start();
  [[nodiscard]] DeviceResult<> restore_lock();
  void close();
  [[nodiscard]] FrameEvent deliver(const FilledSlot& filled);
  /// Nothing when it is worth looking for a frame.
  [[nodiscard]] std::optional<FrameEvent> wait_for_device(std::chrono::nanoseconds deadline);
  [[nodiscard]] FrameEvent refuse(DeviceFault fault);
  [[nodiscard]] DeviceFault silence() const;

  LibcameraOptions options_;
  const Clock& clock_;
  std::unique_ptr<CameraHub> hub_;             ///< since the first start; goes after the streams
  std::unique_ptr<CameraStream> gone_stream_;  ///< of the camera that was unplugged last
  std::unique_ptr<CameraStream> stream_;       ///< nothing when stopped
  bool is_abandoned_ = false;                  ///< the camera went and libcamera did not notice
  LibcameraControls controls_;
  WakeEvent stop_requested_;
  SourceInfo info_;
  FrameSequence sequence_;
  std::uint64_t missed_ = 0;  ///< since the last frame that was delivered
  std::optional<std::chrono::nanoseconds> last_timestamp_;
  FrameCounters counters_;
};

}  // namespace trigmesh
