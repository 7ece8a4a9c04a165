#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/camera/camera_mode.hpp"
#include "drivers/camera/pixel_format.hpp"
#include "drivers/camera/v4l2/kernel.hpp"

namespace trigmesh {

/// V4L2's code of a format; 0 for formats that it does not have (PNG).
[[nodiscard]] std::uint32_t fourcc_of(PixelFormat format);

/// Our name for V4L2's code; nothing for formats that we do not read.
[[nodiscard]] std::optional<PixelFormat> format_of_fourcc(std::uint32_t fourcc);

/// Asks an open camera for its modes in formats that we read, each with the rate nearest to the
/// wish. Cameras that take any size within bounds are asked for the wished one. A camera that tells
/// no sizes at all is given the wish to try.
[[nodiscard]] std::vector<CameraMode> list_modes(Kernel& kernel, int fd, const CameraWish& wish);

}  // namespace trigmesh
