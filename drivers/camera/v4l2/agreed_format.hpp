#pragma once

#include <chrono>
#include <string>

#include "drivers/camera/camera_mode.hpp"
#include "drivers/camera/pixel_format.hpp"
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

}  // namespace trigmesh
