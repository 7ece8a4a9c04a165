#include "tests/unit/drivers/camera/v4l2/fake_kernel.hpp"

#include <algorithm>
#include <cerrno>

#include <gtest/gtest.h>

namespace trigmesh::test_support {
namespace {

/// The input that is selected, of several.
constexpr int kInput = 3;

}  // namespace

int FakeKernel::open(const std::string& path) {
  if (!is_plugged || path != "/dev/video0") {
    return -ENOENT;
  }
  if (open_error != 0) {
    return -open_error;
  }
  open_fds.insert(next_fd_);
  return next_fd_++;
}

void FakeKernel::close(int fd) {
  EXPECT_EQ(open_fds.erase(fd), 1U) << "closed twice";
  if (open_fds.empty()) {  // the last one ends the stream, whatever was refused before
    is_streaming = false;
    waiting_.clear();
    queued = 0;
  }
}

int FakeKernel::ioctl(int fd, unsigned long request, void* argument) {
  EXPECT_EQ(open_fds.count(fd), 1U) << "used after it was closed";
  calls.push_back(request);
  if (nth_ioctl > 0 && --nth_ioctl == 0) {
    return -nth_error;
  }
  if (!is_plugged) {
    return -ENODEV;
  }
  if (const auto error = errors.find(request); error != errors.end()) {
    return -error->second;
  }
  return answer(request, argument);
}

int FakeKernel::answer(unsigned long request, void* argument) {
  switch (request) {
    case VIDIOC_QUERYCAP:
      *static_cast<v4l2_capability*>(argument) = capability;
      return 0;
    case VIDIOC_ENUM_FMT:
      return enumerate_format(*static_cast<v4l2_fmtdesc*>(argument));
    case VIDIOC_ENUM_FRAMESIZES:
      return enumerate_size(*static_cast<v4l2_frmsizeenum*>(argument));
    case VIDIOC_ENUM_FRAMEINTERVALS:
      return enumerate_interval(*static_cast<v4l2_frmivalenum*>(argument));
    case VIDIOC_S_FMT:
      return set_format(*static_cast<v4l2_format*>(argument));
    case VIDIOC_S_PARM:
      interval = static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe;
      return 0;
    case VIDIOC_REQBUFS:
      return request_buffers(*static_cast<v4l2_requestbuffers*>(argument));
    case VIDIOC_QUERYBUF: {
      auto& buffer = *static_cast<v4l2_buffer*>(argument);
      buffer.length = static_cast<__u32>(buffer_size);
      buffer.m.offset = buffer.index << 20U;
      return 0;
    }
    case VIDIOC_QBUF:
      return queue(*static_cast<const v4l2_buffer*>(argument));
    case VIDIOC_DQBUF:
      return dequeue(*static_cast<v4l2_buffer*>(argument));
    case VIDIOC_STREAMON:
      is_streaming = true;
      return 0;
    case VIDIOC_STREAMOFF:
      is_streaming = false;
      waiting_.clear();
      queued = 0;
      return 0;
    case VIDIOC_G_INPUT:
      *static_cast<int*>(argument) = kInput;
      return has_inputs ? 0 : -ENOTTY;
    case VIDIOC_ENUMINPUT:
      EXPECT_EQ(static_cast<const v4l2_input*>(argument)->index, __u32{kInput});
      static_cast<v4l2_input*>(argument)->status = input_status;
      return 0;
    case VIDIOC_SUBSCRIBE_EVENT:
      tells_signal_changes =
          has_inputs && static_cast<const v4l2_event_subscription*>(argument)->id == kInput;
      return has_inputs ? 0 : -EINVAL;
    case VIDIOC_DQEVENT:
      return take_event(*static_cast<v4l2_event*>(argument));
    case VIDIOC_QUERYCTRL:
      return query_control(*static_cast<v4l2_queryctrl*>(argument));
    case VIDIOC_QUERYMENU: {
      const auto& menu = *static_cast<const v4l2_querymenu*>(argument);
      return controls.at(menu.id).menu.count(menu.index) > 0 ? 0 : -EINVAL;
    }
    case VIDIOC_G_CTRL: {
      auto& control = *static_cast<v4l2_control*>(argument);
      control.value = controls.at(control.id).value;
      return 0;
    }
    case VIDIOC_S_CTRL:
      return set_control(*static_cast<const v4l2_control*>(argument));
    default:
      return -ENOTTY;
  }
}

const FakeFormat* FakeKernel::find_format(__u32 fourcc) const {
  const auto found = std::find_if(
      formats.begin(), formats.end(), [&](const FakeFormat& f) { return f.fourcc == fourcc; });
  return found == formats.end() ? nullptr : &*found;
}

int FakeKernel::enumerate_format(v4l2_fmtdesc& entry) const {
  if (entry.index >= formats.size()) {
    return -EINVAL;
  }
  entry.pixelformat = formats[entry.index].fourcc;
  return 0;
}

int FakeKernel::enumerate_size(v4l2_frmsizeenum& entry) const {
  const FakeFormat* format = find_format(entry.pixel_format);
  if (format == nullptr || entry.index >= format->sizes.size()) {
    return -EINVAL;
  }
  entry.type = V4L2_FRMSIZE_TYPE_DISCRETE;
  entry.discrete = {format->sizes[entry.index].width, format->sizes[entry.index].height};
  return 0;
}

int FakeKernel::enumerate_interval(v4l2_frmivalenum& entry) const {
  const FakeFormat* format = find_format(entry.pixel_format);
  for (const FakeSize& size : format->sizes) {
    if (size.width == entry.width && size.height == entry.height &&
        entry.index < size.intervals.size()) {
      entry.type = V4L2_FRMIVAL_TYPE_DISCRETE;
      entry.discrete = size.intervals[entry.index];
      return 0;
    }
  }
  return -EINVAL;
}

int FakeKernel::set_format(v4l2_format& format) const {
  if (forced_fourcc != 0) {
    format.fmt.pix.pixelformat = forced_fourcc;
  }
  if (forced_field != 0) {
    format.fmt.pix.field = forced_field;
  }
  format.fmt.pix.bytesperline = bytes_per_line;
  format.fmt.pix.sizeimage = static_cast<__u32>(buffer_size);
  return 0;
}

int FakeKernel::request_buffers(v4l2_requestbuffers& request) {
  for (auto& memory : memory_) {
    orphans_.push_back(std::move(memory));
  }
  memory_.clear();
  request.count = std::min(request.count, most_buffers);
  for (__u32 i = 0; i < request.count; ++i) {
    memory_.push_back(std::make_unique<std::vector<std::uint8_t>>(buffer_size));
  }
  return 0;
}

MappedMemory FakeKernel::map(int fd, std::size_t size, std::int64_t offset) {
  EXPECT_EQ(open_fds.count(fd), 1U);
  EXPECT_EQ(size, buffer_size);
  if (map_error != 0) {
    return {nullptr, map_error};
  }
  std::uint8_t* address = memory_.at(static_cast<std::size_t>(offset >> 20))->data();
  mappings.insert(address);
  return {address, 0};
}

void FakeKernel::unmap(std::uint8_t* address, std::size_t) {
  EXPECT_EQ(mappings.erase(address), 1U) << "unmapped twice";
}

int FakeKernel::queue(const v4l2_buffer& buffer) {
  EXPECT_EQ(std::count(waiting_.begin(), waiting_.end(), buffer.index), 0) << "queued twice";
  waiting_.push_back(buffer.index);
  ++queued;
  return 0;
}

int FakeKernel::dequeue(v4l2_buffer& buffer) {
  if (!is_streaming) {
    return -EINVAL;
  }
  if (frames.empty() || waiting_.empty()) {
    return -EAGAIN;
  }
  const FakeFrame frame = frames.front();
  frames.pop_front();
  buffer.index = waiting_.front();
  waiting_.pop_front();
  --queued;
  std::copy(frame.bytes.begin(), frame.bytes.end(), memory_[buffer.index]->begin());
  buffer.bytesused =
      frame.claimed_bytes != 0 ? frame.claimed_bytes : static_cast<__u32>(frame.bytes.size());
  buffer.sequence = frame.sequence;
  buffer.flags = frame.flags;
  buffer.timestamp.tv_sec = frame.timestamp.count() / 1'000'000;
  buffer.timestamp.tv_usec = frame.timestamp.count() % 1'000'000;
  return 0;
}

int FakeKernel::take_event(v4l2_event& event) {
  if (signal_changes == 0) {
    return -ENOENT;
  }
  --signal_changes;
  event.type = V4L2_EVENT_SOURCE_CHANGE;
  return 0;
}

int FakeKernel::query_control(v4l2_queryctrl& query) const {
  const auto found = controls.find(query.id);
  if (found == controls.end()) {
    return -EINVAL;
  }
  query.minimum = found->second.minimum;
  query.maximum = found->second.maximum;
  query.step = found->second.step;
  query.default_value = found->second.standard;
  return 0;
}

int FakeKernel::set_control(const v4l2_control& control) {
  FakeControl& entry = controls.at(control.id);
  if (control.value < entry.minimum || control.value > entry.maximum) {
    return -ERANGE;
  }
  if (!entry.is_stuck) {
    entry.value = control.value / entry.step * entry.step;
  }
  return 0;
}

int FakeKernel::poll(std::span<pollfd> descriptors, int timeout_ms) {
  ++poll_count;
  int ready = 0;
  for (pollfd& entry : descriptors) {
    entry.revents = 0;
    if (open_fds.count(entry.fd) == 0) {
      ready += ::poll(&entry, 1, 0);  // the stop request is a real descriptor
    } else if (!is_plugged) {
      entry.revents = POLLERR | POLLHUP;
      ++ready;
    } else if (tells_signal_changes && signal_changes > 0) {
      EXPECT_NE(entry.events & POLLPRI, 0) << "nobody looks at the events";
      entry.revents = POLLPRI;
      ++ready;
    } else if (poll_events != 0 || !frames.empty()) {
      entry.revents = poll_events != 0 ? poll_events : short{POLLIN};
      ++ready;
    }
  }
  if (ready == 0) {
    time_.time += std::chrono::milliseconds(timeout_ms);
  }
  return ready;
}

std::vector<std::string> FakeKernel::list(const std::string& folder) {
  std::vector<std::string> names;
  if (folder == "/dev" && is_plugged) {
    names = {"null", "video", "video0", "videox"};
  }
  for (const auto& [path, target] : links) {
    if (is_plugged && path.substr(0, path.rfind('/')) == folder) {
      names.push_back(path.substr(path.rfind('/') + 1));
    }
  }
  return names;
}

std::string FakeKernel::resolve(const std::string& path) {
  if (!is_plugged) {
    return {};
  }
  const auto link = links.find(path);
  if (link != links.end()) {
    return link->second;
  }
  return path == "/dev/video0" ? path : std::string();
}

}  // namespace trigmesh::test_support
