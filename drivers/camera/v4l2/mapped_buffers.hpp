#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/camera/frame.hpp"
#include "drivers/camera/v4l2/kernel.hpp"
#include "drivers/device/device_fault.hpp"

namespace trigmesh {

/// What the driver says about a buffer that it has filled.
struct FilledBuffer {
  std::size_t slot = 0;
  std::size_t bytes_used = 0;
  std::uint32_t sequence = 0;
  bool is_damaged = false;  ///< the driver itself says so
  /// Of CLOCK_MONOTONIC; absent when the driver stamps with another clock or not at all.
  std::optional<std::chrono::nanoseconds> timestamp;
  FrameMoment moment = FrameMoment::kFrameEnd;
};

/// The buffers that a driver writes and we read, mapped, and the open device with them. A buffer
/// belongs to the driver until it is dequeued, then to a frame until that is released. end() may
/// come while frames are out: their memory stays until each is released.
/// Threads: give_back on any; the rest on the thread of the source.
class MappedBuffers final : public FramePool {
 public:
  /// Asks for `count` buffers (the driver may give fewer or more), maps them, hands all to the
  /// driver and starts the stream. Takes the device over; after a fault it is closed. `camera` is
  /// for messages.
  [[nodiscard]] static DeviceResult<std::shared_ptr<MappedBuffers>> start(KernelFd device,
                                                                          std::size_t count,
                                                                          std::string camera);

  ~MappedBuffers() override;
  MappedBuffers(const MappedBuffers&) = delete;
  MappedBuffers& operator=(const MappedBuffers&) = delete;
  MappedBuffers(MappedBuffers&&) = delete;
  MappedBuffers& operator=(MappedBuffers&&) = delete;

  /// The next filled buffer; nothing when there is none yet. Never blocks.
  [[nodiscard]] DeviceResult<std::optional<FilledBuffer>> dequeue();

  /// The whole memory of a slot.
  [[nodiscard]] std::span<const std::uint8_t> memory(std::size_t slot) const;

  void give_back(std::size_t slot) noexcept override;

  /// Buffers that the driver has now. 0: it can only lose frames.
  [[nodiscard]] std::size_t queued_count() const;

  [[nodiscard]] std::size_t count() const { return buffers_.size(); }

  /// Readable when a buffer is filled; see poll(2) of V4L2.
  [[nodiscard]] int fd() const { return device_.get(); }

  /// Stops the stream, gives the driver its memory back and closes the device.
  void end() noexcept;

 private:
  enum class Owner : std::uint8_t { kUs, kDriver, kFrame };

  struct Buffer {
    std::uint8_t* address = nullptr;
    std::size_t size = 0;
    Owner owner = Owner::kUs;
  };

  MappedBuffers(KernelFd device, std::string camera);

  [[nodiscard]] DeviceResult<> request(std::size_t count);
  [[nodiscard]] DeviceResult<> map(std::size_t slot);
  [[nodiscard]] DeviceResult<> begin();
  [[nodiscard]] int queue(std::size_t slot);
  void queue_what_is_ours();
  void unmap(Buffer& buffer);
  [[nodiscard]] tl::unexpected<DeviceFault> failed(int error, std::string_view attempt) const;

  KernelFd device_;
  const std::shared_ptr<Kernel> kernel_;  // unmaps after the device is closed
  const std::string camera_;
  mutable std::mutex mutex_;
  std::vector<Buffer> buffers_;  ///< its owners are guarded by mutex_
  bool is_streaming_ = false;    ///< guarded by mutex_
};

}  // namespace trigmesh
