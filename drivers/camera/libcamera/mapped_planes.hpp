#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "drivers/device/device_fault.hpp"

namespace trigmesh {

/// Where one plane of a buffer lies: a piece of the memory behind a descriptor.
struct PlanePlace {
  int fd = -1;
  std::size_t offset = 0;
  std::size_t size = 0;
};

/// The planes of one buffer, mapped for reading in one piece. The memory stays when the descriptor
/// is closed. Thread-compatible.
class MappedPlanes {
 public:
  /// Planes have to follow one another in the same memory with `chroma_offset` bytes from the first
  /// to the second, because that is how frames are read. kFormatRefused: they do not; kIo: no
  /// mapping. `camera` is for messages.
  [[nodiscard]] static DeviceResult<MappedPlanes> map(std::span<const PlanePlace> planes,
                                                      std::size_t chroma_offset,
                                                      const std::string& camera);

  MappedPlanes(const MappedPlanes&) = delete;
  MappedPlanes& operator=(const MappedPlanes&) = delete;
  MappedPlanes(MappedPlanes&& other) noexcept;
  MappedPlanes& operator=(MappedPlanes&& other) noexcept;

  ~MappedPlanes() { unmap(); }

  /// From the first byte of the first plane to the last of the last; empty when unmapped.
  [[nodiscard]] std::span<const std::uint8_t> bytes() const { return bytes_; }

  /// Around reading a picture: on boards whose processor does not see what a device writes, caches
  /// are brought up to date.
  void begin_reading() const noexcept;
  void end_reading() const noexcept;

  void unmap() noexcept;

 private:
  MappedPlanes(void* address, std::size_t size, int fd, std::span<const std::uint8_t> bytes)
      : address_(address), size_(size), fd_(fd), bytes_(bytes) {}

  void* address_ = nullptr;
  std::size_t size_ = 0;
  int fd_ = -1;  ///< a descriptor of our own
  std::span<const std::uint8_t> bytes_;
};

}  // namespace trigmesh
