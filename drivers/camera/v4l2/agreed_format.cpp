#include "drivers/camera/v4l2/agreed_format.hpp"

#include <algorithm>
#include <cerrno>

#include <linux/videodev2.h>

#include "drivers/camera/v4l2/camera_mode.hpp"

namespace trigmesh {
namespace {

/// The four characters of a format code, for messages.
std::string text_of_fourcc(std::uint32_t code) {
  std::string text;
  for (int shift = 0; shift < 32; shift += 8) {
    const auto c = static_cast<char>((code >> static_cast<unsigned>(shift)) & 0x7FU);
    text += c >= ' ' && c <= '~' ? c : '?';
  }
  return text;
}

/// Asks for the rate; a driver without rates is left alone.
DeviceResult<std::chrono::nanoseconds> agree_on_rate(Kernel& kernel,
                                                     int fd,
                                                     std::chrono::nanoseconds interval,
                                                     const std::string& camera) {
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  v4l2_fract& wanted = parameters.parm.capture.timeperframe;
  constexpr std::int64_t kUnitsPerSecond = 10'000'000;  // of 100 ns, as UVC counts
  // Rounded up: drivers that look for the first interval that is not longer would take the next
  // one.
  const std::int64_t units = (interval.count() + 99) / 100;
  wanted.numerator = static_cast<__u32>(std::clamp<std::int64_t>(units, 1, 1 << 30));
  wanted.denominator = static_cast<__u32>(kUnitsPerSecond);
  const int status = kernel.ioctl(fd, VIDIOC_S_PARM, &parameters);
  if (status == -EINVAL || status == -ENOTTY) {
    return std::chrono::nanoseconds(0);
  }
  if (status < 0) {
    return tl::unexpected<DeviceFault>(
        fault_of_errno(-status, "cannot set the frame rate of camera", camera));
  }
  const v4l2_fract& taken = parameters.parm.capture.timeperframe;
  if (taken.denominator == 0) {
    return std::chrono::nanoseconds(0);
  }
  return std::chrono::nanoseconds(static_cast<std::int64_t>(std::uint64_t{taken.numerator} *
                                                            1'000'000'000 / taken.denominator));
}

DeviceResult<FrameLayout> layout_of(const v4l2_pix_format& taken,
                                    PixelFormat wanted,
                                    const std::string& camera) {
  if (format_of_fourcc(taken.pixelformat) != wanted) {
    return device_fault(FaultKind::kFormatRefused,
                        "camera {} was asked for {} and insists on {}",
                        camera,
                        to_string(wanted),
                        text_of_fourcc(taken.pixelformat));
  }
  if (taken.field != V4L2_FIELD_NONE && taken.field != V4L2_FIELD_ANY) {
    return device_fault(FaultKind::kFormatRefused,
                        "camera {} delivers interlaced fields; only whole pictures are read",
                        camera);
  }
  FrameLayout layout;
  layout.format = wanted;
  constexpr __u32 kMostPixels = 65'535;  // on a side; sizes stay within an int and a product
  layout.width_px = static_cast<int>(std::min(taken.width, kMostPixels));
  layout.height_px = static_cast<int>(std::min(taken.height, kMostPixels));
  if (is_encoded(wanted)) {
    return layout;
  }
  const std::size_t row = row_bytes(wanted, layout.width_px);
  layout.stride_bytes = taken.bytesperline == 0 ? row : taken.bytesperline;
  if (layout.stride_bytes < row || layout.width_px == 0 || layout.height_px == 0) {
    return device_fault(FaultKind::kFormatRefused,
                        "camera {} claims {} x {} pixels of {} in rows of {} bytes",
                        camera,
                        layout.width_px,
                        layout.height_px,
                        to_string(wanted),
                        layout.stride_bytes);
  }
  return layout;
}

}  // namespace

DeviceResult<AgreedFormat> agree_on_format(Kernel& kernel,
                                           int fd,
                                           const CameraMode& mode,
                                           const std::string& camera) {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  format.fmt.pix.width = static_cast<__u32>(mode.width_px);
  format.fmt.pix.height = static_cast<__u32>(mode.height_px);
  format.fmt.pix.pixelformat = fourcc_of(mode.format);
  format.fmt.pix.field = V4L2_FIELD_NONE;
  if (const int status = kernel.ioctl(fd, VIDIOC_S_FMT, &format); status < 0) {
    DeviceFault fault = fault_of_errno(-status, "cannot set the picture format of camera", camera);
    if (status == -EINVAL) {
      fault.kind = FaultKind::kFormatRefused;
    }
    return tl::unexpected<DeviceFault>(std::move(fault));
  }
  AgreedFormat agreed;
  TM_ASSIGN_OR_FAULT(agreed.layout, layout_of(format.fmt.pix, mode.format, camera));
  if (mode.frame_interval.count() > 0) {
    TM_ASSIGN_OR_FAULT(agreed.frame_interval,
                       agree_on_rate(kernel, fd, mode.frame_interval, camera));
  }
  return agreed;
}

}  // namespace trigmesh
