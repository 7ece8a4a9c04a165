#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/camera/camera_controls.hpp"
#include "drivers/camera/camera_mode.hpp"
#include "drivers/camera/libcamera/camera_hub.hpp"
#include "drivers/camera/libcamera/frame_exchange.hpp"

namespace libcamera {
class CameraConfiguration;
class FrameBufferAllocator;
class Request;
class Stream;
}  // namespace libcamera

namespace trigmesh {

/// What pictures are for; libcamera's pipelines choose sensor modes and tuning by it.
enum class CameraUse : std::uint8_t {
  kVideo,  ///< a steady rate: video mode of the rig
  kStill,  ///< the best single picture, often the whole sensor at a low rate
};

/// A control on its way to the camera.
struct SentControl {
  ControlValue control;
  float blue_gain = 1.0F;  ///< goes with the red one of kWhiteBalance
};

/// How a camera is to stream.
struct StreamWish {
  CameraWish wish;
  CameraUse use = CameraUse::kVideo;
  std::size_t buffer_count = 6;
  std::vector<SentControl> controls;  ///< from the first frame on
};

/// An acquired camera that streams, with its buffers and requests. Threads: completed requests
/// arrive on libcamera's thread; the rest is used on the thread of the source.
class CameraStream {
 public:
  /// kNotFound, kBusy, kFormatRefused, kDisconnected, kIo. The hub outlives the stream.
  [[nodiscard]] static DeviceResult<std::unique_ptr<CameraStream>> start(
      CameraHub& hub, const std::string& stable_name, const StreamWish& wish);

  /// Ends it; libcamera's objects go. A stream whose camera went is kept for a while after end(),
  /// because a pipeline may still name its requests.
  ~CameraStream();
  CameraStream(const CameraStream&) = delete;
  CameraStream& operator=(const CameraStream&) = delete;
  CameraStream(CameraStream&&) = delete;
  CameraStream& operator=(CameraStream&&) = delete;

  /// Stops the camera and lets it go; frames that are out stay readable.
  void end();

  /// Looks whether the camera's devices are still there, and if not does what the hub does when
  /// libcamera tells it. To be asked when nothing came for a while.
  void notice_loss();

  /// Whether the camera went without libcamera noticing. libcamera takes it for running: end() left
  /// it as it is, and neither the stream nor its hub may be destroyed.
  [[nodiscard]] bool is_abandoned() const { return is_abandoned_; }

  [[nodiscard]] const std::shared_ptr<FrameExchange>& exchange() const { return exchange_; }

  [[nodiscard]] const FrameLayout& layout() const { return layout_; }

  /// 0: the camera does not tell.
  [[nodiscard]] std::chrono::nanoseconds frame_interval() const { return frame_interval_; }

  /// Nothing when the camera does not have the control.
  [[nodiscard]] std::optional<ControlRange> range(ControlId id) const;

  /// Sends a control with the next request; frames whose control_round is not less than what is
  /// returned were asked for with it.
  [[nodiscard]] std::uint64_t send(const SentControl& control);

 private:
  CameraStream(CameraHub& hub, std::shared_ptr<libcamera::Camera> camera);

  [[nodiscard]] DeviceResult<> configure(const StreamWish& wish);
  [[nodiscard]] DeviceResult<> agree(const CameraWish& wish);
  [[nodiscard]] DeviceResult<> allocate();
  [[nodiscard]] DeviceResult<> run(const StreamWish& wish);
  [[nodiscard]] bool queue(std::size_t slot);
  void on_completed(libcamera::Request* request);
  [[nodiscard]] tl::unexpected<DeviceFault> failed(int status, std::string_view attempt) const;

  CameraHub& hub_;
  std::shared_ptr<libcamera::Camera> camera_;
  const std::string name_;
  std::unique_ptr<libcamera::CameraConfiguration> configuration_;
  libcamera::Stream* stream_ = nullptr;  ///< the camera's
  std::unique_ptr<libcamera::FrameBufferAllocator> allocator_;
  std::vector<std::unique_ptr<libcamera::Request>> requests_;  ///< by slot; before their buffers
  std::shared_ptr<FrameExchange> exchange_;  ///< shared with frames, which may outlive the stream
  FrameLayout layout_;
  std::chrono::nanoseconds frame_interval_{0};
  DevicePresence presence_;
  bool is_acquired_ = false;
  bool is_abandoned_ = false;

  std::mutex mutex_;                   ///< taken with the exchange locked
  std::vector<SentControl> pending_;   ///< guarded by mutex_; for the next request
  std::vector<std::uint64_t> rounds_;  ///< guarded by mutex_; by slot
  std::uint64_t last_round_ = 0;       ///< guarded by mutex_
};

}  // namespace trigmesh
