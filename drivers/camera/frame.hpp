#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "drivers/camera/pixel_format.hpp"

namespace trigmesh {

/// Who owns the memory of frames. Lives as long as a frame of it lives, also when its camera is
/// stopped, unplugged or destroyed.
class FramePool {
 public:
  FramePool() = default;
  FramePool(const FramePool&) = delete;
  FramePool& operator=(const FramePool&) = delete;
  FramePool(FramePool&&) = delete;
  FramePool& operator=(FramePool&&) = delete;
  virtual ~FramePool() = default;

  /// Called once for each frame that is released. Thread-safe; does not block on the device.
  virtual void give_back(std::size_t slot) noexcept = 0;
};

/// What a timestamp is the time of.
enum class FrameMoment : std::uint8_t {
  kExposureMiddle,  ///< of the exposure, as recordings have it
  kExposureStart,   ///< the exposure began, or the first byte left the sensor
  kFrameEnd,        ///< the last byte has arrived: the exposure lies before it
  kReceived,        ///< we took it from the driver, which stamped nothing that can be believed
};

/// What is known of a frame besides its bytes.
struct FrameInfo {
  /// File name relative to the image folder, '/' as separator; empty for frames of a camera.
  /// Valid as long as the frame.
  std::string_view name;
  /// Of a camera: CLOCK_MONOTONIC as the kernel stamped it, so that it compares with trigger edges.
  /// Of a recording: the clock of the recording. Absent for plain photographs.
  std::optional<std::chrono::nanoseconds> timestamp;
  FrameMoment moment = FrameMoment::kExposureMiddle;
  /// Counted from 0 for each start(), with the frames that were lost or damaged; does not wrap. Of
  /// a recording: the position.
  std::uint64_t sequence = 0;
  /// Frames lost between the one before and this one.
  std::uint64_t missed_before = 0;
  FrameLayout layout;
  std::optional<std::chrono::nanoseconds> exposure;  ///< how long, when the device tells
  std::optional<double> gain;                        ///< total gain as a factor, when it tells
};

/// One picture in the buffer that the device wrote: nothing is copied, and destroying the frame
/// (or moving another one into it) gives the buffer back, whatever path it took. A frame may be
/// moved to and released on any thread. Holding as many frames as the device has buffers starves
/// it: copy what is kept for long. An empty frame has no bytes.
class Frame {
 public:
  Frame() = default;

  /// `bytes` lies in slot `slot` of `pool` and stays there until the slot is given back.
  Frame(FrameInfo info,
        std::span<const std::uint8_t> bytes,
        // Shared: the frames and the source own the pool together, and the last one ends it.
        std::shared_ptr<FramePool> pool,
        std::size_t slot)
      : info_(info), bytes_(bytes), pool_(std::move(pool)), slot_(slot) {}

  Frame(const Frame&) = delete;
  Frame& operator=(const Frame&) = delete;

  Frame(Frame&& other) noexcept
      : info_(std::exchange(other.info_, FrameInfo{})),
        bytes_(std::exchange(other.bytes_, {})),
        pool_(std::move(other.pool_)),
        slot_(other.slot_) {}

  Frame& operator=(Frame&& other) noexcept {
    if (this != &other) {
      release();
      info_ = std::exchange(other.info_, FrameInfo{});
      bytes_ = std::exchange(other.bytes_, {});
      pool_ = std::move(other.pool_);
      slot_ = other.slot_;
    }
    return *this;
  }

  ~Frame() { release(); }

  [[nodiscard]] const FrameInfo& info() const { return info_; }

  /// Another time for the same picture, for a recording that stands for a camera.
  void set_time(std::chrono::nanoseconds timestamp, FrameMoment moment) {
    info_.timestamp = timestamp;
    info_.moment = moment;
  }

  /// Encoded formats: the whole file. Raw formats: layout().height_px rows of layout().stride_bytes
  /// (NV12: then half as many rows of interleaved chroma).
  [[nodiscard]] std::span<const std::uint8_t> bytes() const { return bytes_; }

  [[nodiscard]] bool empty() const { return pool_ == nullptr; }

  /// Gives the buffer back now; the frame is empty afterwards.
  void release() noexcept {
    if (const std::shared_ptr<FramePool> pool = std::exchange(pool_, nullptr)) {
      pool->give_back(slot_);
    }
    bytes_ = {};
    info_ = {};
  }

 private:
  FrameInfo info_;
  std::span<const std::uint8_t> bytes_;
  std::shared_ptr<FramePool> pool_;
  std::size_t slot_ = 0;
};

}  // namespace trigmesh
