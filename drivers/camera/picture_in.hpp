#pragma once

#include <cstdint>
#include <span>

#include "drivers/camera/pixel_format.hpp"
#include "drivers/device/device_fault.hpp"

namespace trigmesh {

/// The bytes of a buffer that are the picture. Raw: from the first pixel to the last, padding
/// included. JPEG: up to its end, without what cameras leave behind it. kShortFrame: fewer bytes
/// than the picture needs; kCorruptFrame: no whole JPEG, or one of another size than was agreed.
[[nodiscard]] DeviceResult<std::span<const std::uint8_t>> picture_in(
    std::span<const std::uint8_t> bytes, const FrameLayout& layout);

}  // namespace trigmesh
