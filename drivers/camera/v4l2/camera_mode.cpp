#include "drivers/camera/v4l2/camera_mode.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <linux/videodev2.h>

namespace trigmesh {
namespace {

/// More than any camera has; a driver that never ends its list does not hang us.
constexpr std::uint32_t kMaxEntries = 256;

constexpr std::array<std::pair<PixelFormat, std::uint32_t>, 11> kFourccs = {{
    {PixelFormat::kJpeg, V4L2_PIX_FMT_MJPEG},
    {PixelFormat::kYuyv, V4L2_PIX_FMT_YUYV},
    {PixelFormat::kUyvy, V4L2_PIX_FMT_UYVY},
    {PixelFormat::kNv12, V4L2_PIX_FMT_NV12},
    {PixelFormat::kGrey, V4L2_PIX_FMT_GREY},
    {PixelFormat::kBayerRggb, V4L2_PIX_FMT_SRGGB8},
    {PixelFormat::kBayerGrbg, V4L2_PIX_FMT_SGRBG8},
    {PixelFormat::kBayerGbrg, V4L2_PIX_FMT_SGBRG8},
    {PixelFormat::kBayerBggr, V4L2_PIX_FMT_SBGGR8},
    {PixelFormat::kRgb24, V4L2_PIX_FMT_RGB24},
    {PixelFormat::kBgr24, V4L2_PIX_FMT_BGR24},
}};

std::chrono::nanoseconds duration_of(const v4l2_fract& interval) {
  if (interval.denominator == 0) {
    return std::chrono::nanoseconds(0);
  }
  constexpr std::uint64_t kPerSecond = 1'000'000'000;
  return std::chrono::nanoseconds(static_cast<std::int64_t>(std::uint64_t{interval.numerator} *
                                                            kPerSecond / interval.denominator));
}

/// The interval of a mode that is nearest to the wish.
std::chrono::nanoseconds ask_interval(Kernel& kernel,
                                      int fd,
                                      const CameraMode& mode,
                                      const CameraWish& wish) {
  const std::chrono::nanoseconds wanted = wished_interval(wish);
  std::optional<std::chrono::nanoseconds> best;
  for (std::uint32_t i = 0; i < kMaxEntries; ++i) {
    v4l2_frmivalenum entry{};
    entry.index = i;
    entry.pixel_format = fourcc_of(mode.format);
    entry.width = static_cast<std::uint32_t>(mode.width_px);
    entry.height = static_cast<std::uint32_t>(mode.height_px);
    if (kernel.ioctl(fd, VIDIOC_ENUM_FRAMEINTERVALS, &entry) < 0) {
      break;
    }
    if (entry.type != V4L2_FRMIVAL_TYPE_DISCRETE) {
      const auto shortest = duration_of(entry.stepwise.min);
      return std::clamp(wanted, shortest, std::max(shortest, duration_of(entry.stepwise.max)));
    }
    const std::chrono::nanoseconds interval = duration_of(entry.discrete);
    if (!best || std::chrono::abs(interval - wanted) < std::chrono::abs(*best - wanted)) {
      best = interval;
    }
  }
  return best.value_or(std::chrono::nanoseconds(0));
}

void add_sizes(Kernel& kernel,
               int fd,
               PixelFormat format,
               const CameraWish& wish,
               std::vector<CameraMode>& modes) {
  for (std::uint32_t i = 0; i < kMaxEntries; ++i) {
    v4l2_frmsizeenum entry{};
    entry.index = i;
    entry.pixel_format = fourcc_of(format);
    if (kernel.ioctl(fd, VIDIOC_ENUM_FRAMESIZES, &entry) < 0) {
      if (i == 0) {
        modes.push_back({format, wish.width_px, wish.height_px, {}});
      }
      return;
    }
    CameraMode mode{format, 0, 0, {}};
    const bool is_discrete = entry.type == V4L2_FRMSIZE_TYPE_DISCRETE;
    if (is_discrete) {
      mode.width_px = static_cast<int>(entry.discrete.width);
      mode.height_px = static_cast<int>(entry.discrete.height);
    } else {
      const v4l2_frmsize_stepwise& steps = entry.stepwise;
      mode.width_px =
          nearest_step(wish.width_px, steps.min_width, steps.max_width, steps.step_width);
      mode.height_px =
          nearest_step(wish.height_px, steps.min_height, steps.max_height, steps.step_height);
    }
    mode.frame_interval = ask_interval(kernel, fd, mode, wish);
    modes.push_back(mode);
    if (!is_discrete) {
      return;
    }
  }
}

}  // namespace

std::uint32_t fourcc_of(PixelFormat format) {
  for (const auto& [ours, theirs] : kFourccs) {
    if (ours == format) {
      return theirs;
    }
  }
  return 0;
}

std::optional<PixelFormat> format_of_fourcc(std::uint32_t fourcc) {
  if (fourcc == V4L2_PIX_FMT_JPEG) {
    return PixelFormat::kJpeg;
  }
  for (const auto& [ours, theirs] : kFourccs) {
    if (theirs == fourcc) {
      return ours;
    }
  }
  return std::nullopt;
}

std::vector<CameraMode> list_modes(Kernel& kernel, int fd, const CameraWish& wish) {
  std::vector<CameraMode> modes;
  for (std::uint32_t i = 0; i < kMaxEntries; ++i) {
    v4l2_fmtdesc entry{};
    entry.index = i;
    entry.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (kernel.ioctl(fd, VIDIOC_ENUM_FMT, &entry) < 0) {
      break;
    }
    // Formats that libv4l or the driver makes from others would only cost time.
    const std::optional<PixelFormat> format = format_of_fourcc(entry.pixelformat);
    if (format && (entry.flags & V4L2_FMT_FLAG_EMULATED) == 0U) {
      add_sizes(kernel, fd, *format, wish, modes);
    }
  }
  return modes;
}

}  // namespace trigmesh
