#pragma once

#include <cstdint>
#include <optional>

#include "drivers/camera/pixel_format.hpp"

namespace trigmesh {

/// libcamera's code of a format; 0 for formats that it does not have (PNG). libcamera takes DRM's
/// names, which spell a pixel from the highest bits of a little-endian word to the lowest: BGR888
/// lies in memory as red, green, blue, and is our kRgb24; RGB888 is our kBgr24. V4L2 spells the
/// bytes in the order of memory, so its RGB24 is DRM's BGR888.
[[nodiscard]] std::uint32_t drm_code_of(PixelFormat format);

/// Our name for libcamera's code; nothing for formats that we do not read.
[[nodiscard]] std::optional<PixelFormat> format_of_drm_code(std::uint32_t code);

}  // namespace trigmesh
