#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "drivers/camera/pixel_format.hpp"
#include "drivers/camera/v4l2/camera_mode.hpp"
#include "drivers/camera/v4l2/kernel.hpp"
#include "drivers/device/device_fault.hpp"

namespace trigmesh {

/// What the driver and we agreed on.
struct AgreedFormat {
  FrameLayout layout;
  std::chrono::nanoseconds frame_interval{0};  ///< 0: the driver does not tell
};

/// Sets a mode on an open camera and reads back what the driver made of it: it may change the size
/// and the rate, and pads rows as it likes. kFormatRefused: it insists on another format, on
/// interlaced fields, or on rows that are shorter than their pixels; kBusy: another program
/// streams.
[[nodiscard]] DeviceResult<AgreedFormat> agree_on_format(Kernel& kernel,
                                                         int fd,
                                                         const CameraMode& mode,
                                                         const std::string& camera);

/// The bytes of a buffer that are the picture. Raw: from the first pixel to the last, padding
/// included. JPEG: up to its end, without what cameras leave behind it. kShortFrame: fewer bytes
/// than the picture needs; kCorruptFrame: no whole JPEG, or one of another size than was agreed.
[[nodiscard]] DeviceResult<std::span<const std::uint8_t>> picture_in(
    std::span<const std::uint8_t> bytes, const FrameLayout& layout);

}  // namespace trigmesh
