#include "drivers/camera/v4l2/input_signal.hpp"

#include <cerrno>

#include <linux/videodev2.h>

namespace trigmesh {

DeviceResult<> check_signal(Kernel& kernel, int fd, const std::string& camera) {
  int index = 0;
  v4l2_input input{};
  int status = kernel.ioctl(fd, VIDIOC_G_INPUT, &index);
  if (status >= 0) {
    input.index = static_cast<__u32>(index);
    status = kernel.ioctl(fd, VIDIOC_ENUMINPUT, &input);
  }
  if (status == -ENOTTY || status == -EINVAL) {
    return {};
  }
  if (status < 0) {
    return tl::unexpected<DeviceFault>(
        fault_of_errno(-status, "cannot ask for the signal of camera", camera));
  }
  constexpr __u32 kNoPicture =
      V4L2_IN_ST_NO_POWER | V4L2_IN_ST_NO_SIGNAL | V4L2_IN_ST_NO_H_LOCK | V4L2_IN_ST_NO_SYNC;
  if ((input.status & kNoPicture) != 0U) {
    return device_fault(FaultKind::kNoSignal,
                        "camera {} has no signal at its input: is its source connected and on?",
                        camera);
  }
  return {};
}

void watch_signal(Kernel& kernel, int fd) {
  int index = 0;
  if (kernel.ioctl(fd, VIDIOC_G_INPUT, &index) < 0) {
    return;
  }
  v4l2_event_subscription wish{};
  wish.type = V4L2_EVENT_SOURCE_CHANGE;
  wish.id = static_cast<__u32>(index);                    // only the changes of this input are told
  (void)kernel.ioctl(fd, VIDIOC_SUBSCRIBE_EVENT, &wish);  // refused: it never changes
}

bool take_signal_changes(Kernel& kernel, int fd) {
  bool has_changed = false;
  // A driver keeps few events; the limit is for one that never ends.
  constexpr int kMostEvents = 64;
  for (int i = 0; i < kMostEvents; ++i) {
    v4l2_event event{};
    if (kernel.ioctl(fd, VIDIOC_DQEVENT, &event) < 0) {
      break;
    }
    has_changed = has_changed || event.type == V4L2_EVENT_SOURCE_CHANGE;
  }
  return has_changed;
}

}  // namespace trigmesh
