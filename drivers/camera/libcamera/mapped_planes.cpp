#include "drivers/camera/libcamera/mapped_planes.hpp"

#include <cerrno>
#include <utility>

#include <fcntl.h>
#include <linux/dma-buf.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

namespace trigmesh {
namespace {

/// Memory that is not a dma-buf has nothing to be brought up to date and refuses, which is well.
void synchronise(int fd, std::uint64_t flags) noexcept {
  dma_buf_sync sync{};
  sync.flags = flags;
  int status = 0;
  do {
    status = ::ioctl(fd, DMA_BUF_IOCTL_SYNC, &sync);
  } while (status < 0 && (errno == EINTR || errno == EAGAIN));
}

/// Bytes from the first plane's begin to the last one's end; nothing when they do not follow one
/// another as a frame's planes do.
DeviceResult<std::size_t> joined_size(std::span<const PlanePlace> planes,
                                      std::size_t chroma_offset,
                                      const std::string& camera) {
  if (planes.size() == 1) {
    return planes[0].size;
  }
  const bool is_joined = planes.size() == 2 && planes[0].fd == planes[1].fd &&
                         planes[1].offset == planes[0].offset + chroma_offset;
  if (!is_joined) {
    return device_fault(FaultKind::kFormatRefused,
                        "camera {} delivers {} planes that do not follow one another in memory; "
                        "choose a format with one plane",
                        camera,
                        planes.size());
  }
  return chroma_offset + planes[1].size;
}

}  // namespace

DeviceResult<MappedPlanes> MappedPlanes::map(std::span<const PlanePlace> planes,
                                             std::size_t chroma_offset,
                                             const std::string& camera) {
  TM_ASSIGN_OR_FAULT(const std::size_t size, joined_size(planes, chroma_offset, camera));
  // A mapping begins at a page; the plane need not.
  const std::size_t whole = planes[0].offset + size;
  const int fd = ::fcntl(planes[0].fd, F_DUPFD_CLOEXEC, 0);
  if (fd < 0) {
    return tl::unexpected<DeviceFault>(
        fault_of_errno(errno, "cannot keep a frame buffer of camera", camera));
  }
  void* const address = ::mmap(nullptr, whole, PROT_READ, MAP_SHARED, fd, 0);
  if (address == MAP_FAILED) {
    const int error = errno;
    (void)::close(fd);
    return tl::unexpected<DeviceFault>(
        fault_of_errno(error, "cannot map a frame buffer of camera", camera));
  }
  const auto* first = static_cast<const std::uint8_t*>(address) + planes[0].offset;
  return MappedPlanes(address, whole, fd, {first, size});
}

MappedPlanes::MappedPlanes(MappedPlanes&& other) noexcept
    : address_(std::exchange(other.address_, nullptr)),
      size_(std::exchange(other.size_, 0)),
      fd_(std::exchange(other.fd_, -1)),
      bytes_(std::exchange(other.bytes_, {})) {}

MappedPlanes& MappedPlanes::operator=(MappedPlanes&& other) noexcept {
  if (this != &other) {
    unmap();
    address_ = std::exchange(other.address_, nullptr);
    size_ = std::exchange(other.size_, 0);
    fd_ = std::exchange(other.fd_, -1);
    bytes_ = std::exchange(other.bytes_, {});
  }
  return *this;
}

void MappedPlanes::begin_reading() const noexcept {
  if (fd_ >= 0) {
    synchronise(fd_, DMA_BUF_SYNC_START | DMA_BUF_SYNC_READ);
  }
}

void MappedPlanes::end_reading() const noexcept {
  if (fd_ >= 0) {
    synchronise(fd_, DMA_BUF_SYNC_END | DMA_BUF_SYNC_READ);
  }
}

void MappedPlanes::unmap() noexcept {
  if (address_ != nullptr) {
    (void)::munmap(std::exchange(address_, nullptr), size_);
    (void)::close(std::exchange(fd_, -1));
    bytes_ = {};
  }
}

}  // namespace trigmesh
