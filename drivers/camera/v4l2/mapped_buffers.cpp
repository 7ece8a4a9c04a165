#include "drivers/camera/v4l2/mapped_buffers.hpp"

#include <algorithm>
#include <cerrno>
#include <utility>

#include <linux/videodev2.h>

namespace trigmesh {
namespace {

/// With one buffer the driver has none while we look at it.
constexpr std::size_t kFewestBuffers = 2;

v4l2_buffer buffer_request(std::size_t slot) {
  v4l2_buffer buffer{};
  buffer.index = static_cast<__u32>(slot);
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  return buffer;
}

FilledBuffer describe(const v4l2_buffer& buffer) {
  FilledBuffer filled;
  filled.slot = buffer.index;
  filled.bytes_used = buffer.bytesused;
  filled.sequence = buffer.sequence;
  filled.is_damaged = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0U;
  if ((buffer.flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC) {
    filled.timestamp = std::chrono::seconds(buffer.timestamp.tv_sec) +
                       std::chrono::microseconds(buffer.timestamp.tv_usec);
  }
  if ((buffer.flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE) {
    filled.moment = FrameMoment::kExposureStart;
  }
  return filled;
}

}  // namespace

MappedBuffers::MappedBuffers(KernelFd device, std::string camera)
    : device_(std::move(device)), kernel_(device_.kernel()), camera_(std::move(camera)) {}

MappedBuffers::~MappedBuffers() {
  end();
}

tl::unexpected<DeviceFault> MappedBuffers::failed(int error, std::string_view attempt) const {
  return tl::unexpected<DeviceFault>(fault_of_errno(-error, attempt, camera_));
}

DeviceResult<std::shared_ptr<MappedBuffers>> MappedBuffers::start(KernelFd device,
                                                                  std::size_t count,
                                                                  std::string camera) {
  std::shared_ptr<MappedBuffers> buffers(new MappedBuffers(std::move(device), std::move(camera)));
  TM_RETURN_IF_FAULT(buffers->request(count));
  for (std::size_t slot = 0; slot < buffers->count(); ++slot) {
    TM_RETURN_IF_FAULT(buffers->map(slot));
  }
  TM_RETURN_IF_FAULT(buffers->begin());
  return buffers;
}

DeviceResult<> MappedBuffers::request(std::size_t count) {
  v4l2_requestbuffers wanted{};
  wanted.count = static_cast<__u32>(count);
  wanted.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  wanted.memory = V4L2_MEMORY_MMAP;
  if (const int status = device_.ioctl(VIDIOC_REQBUFS, &wanted); status < 0) {
    return failed(status, "cannot get frame buffers from camera");
  }
  if (wanted.count < kFewestBuffers) {
    return device_fault(FaultKind::kIo,
                        "cannot stream from camera {}: its driver gives {} of {} frame buffers, at "
                        "least {} are needed",
                        camera_,
                        wanted.count,
                        count,
                        kFewestBuffers);
  }
  buffers_.resize(wanted.count);
  return {};
}

DeviceResult<> MappedBuffers::map(std::size_t slot) {
  v4l2_buffer buffer = buffer_request(slot);
  if (const int status = device_.ioctl(VIDIOC_QUERYBUF, &buffer); status < 0) {
    return failed(status, "cannot find a frame buffer of camera");
  }
  const MappedMemory memory = kernel_->map(device_.get(), buffer.length, buffer.m.offset);
  if (memory.address == nullptr) {
    return failed(-memory.error, "cannot map a frame buffer of camera");
  }
  buffers_[slot] = {memory.address, buffer.length, Owner::kUs};
  return {};
}

DeviceResult<> MappedBuffers::begin() {
  const std::lock_guard lock(mutex_);
  for (std::size_t slot = 0; slot < buffers_.size(); ++slot) {
    if (const int status = queue(slot); status < 0) {
      return failed(status, "cannot hand a frame buffer to camera");
    }
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (const int status = device_.ioctl(VIDIOC_STREAMON, &type); status < 0) {
    return failed(status, "cannot start the stream of camera");
  }
  is_streaming_ = true;
  return {};
}

int MappedBuffers::queue(std::size_t slot) {
  v4l2_buffer buffer = buffer_request(slot);
  const int status = device_.ioctl(VIDIOC_QBUF, &buffer);
  buffers_[slot].owner = status < 0 ? Owner::kUs : Owner::kDriver;
  return status;
}

void MappedBuffers::queue_what_is_ours() {
  for (std::size_t slot = 0; slot < buffers_.size(); ++slot) {
    if (buffers_[slot].owner == Owner::kUs && queue(slot) < 0) {
      return;  // what is wrong with the device shows when the next frame is asked for
    }
  }
}

DeviceResult<std::optional<FilledBuffer>> MappedBuffers::dequeue() {
  {
    const std::lock_guard lock(mutex_);
    queue_what_is_ours();
  }
  v4l2_buffer buffer = buffer_request(0);
  const int status = device_.ioctl(VIDIOC_DQBUF, &buffer);
  if (status == -EAGAIN) {
    return std::nullopt;
  }
  if (status < 0) {
    return failed(status, "cannot take a frame from camera");
  }
  const std::lock_guard lock(mutex_);
  if (buffer.index >= buffers_.size() || buffers_[buffer.index].owner != Owner::kDriver) {
    return device_fault(FaultKind::kIo,
                        "the driver of camera {} gave frame buffer {}, which it does not have",
                        camera_,
                        buffer.index);
  }
  buffers_[buffer.index].owner = Owner::kFrame;
  return describe(buffer);
}

std::span<const std::uint8_t> MappedBuffers::memory(std::size_t slot) const {
  return {buffers_[slot].address, buffers_[slot].size};
}

void MappedBuffers::give_back(std::size_t slot) noexcept {
  const std::lock_guard lock(mutex_);
  Buffer& buffer = buffers_[slot];
  buffer.owner = Owner::kUs;
  if (!is_streaming_) {
    unmap(buffer);
    return;
  }
  (void)queue(slot);  // tried again by dequeue, which also tells what is wrong
}

std::size_t MappedBuffers::queued_count() const {
  const std::lock_guard lock(mutex_);
  return static_cast<std::size_t>(
      std::count_if(buffers_.begin(), buffers_.end(), [](const Buffer& buffer) {
        return buffer.owner == Owner::kDriver;
      }));
}

void MappedBuffers::end() noexcept {
  const std::lock_guard lock(mutex_);
  if (!device_.valid()) {
    return;
  }
  is_streaming_ = false;
  // A device that is gone refuses all of this, and nothing else is left to do.
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  (void)device_.ioctl(VIDIOC_STREAMOFF, &type);
  for (Buffer& buffer : buffers_) {
    if (buffer.owner != Owner::kFrame) {
      buffer.owner = Owner::kUs;
      unmap(buffer);
    }
  }
  // Frees the queue for the next start also while frames keep their memory (Linux 4.20 and later).
  v4l2_requestbuffers none{};
  none.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  none.memory = V4L2_MEMORY_MMAP;
  (void)device_.ioctl(VIDIOC_REQBUFS, &none);
  device_.close();
}

void MappedBuffers::unmap(Buffer& buffer) {
  if (std::uint8_t* const address = std::exchange(buffer.address, nullptr)) {
    kernel_->unmap(address, buffer.size);
  }
}

}  // namespace trigmesh
