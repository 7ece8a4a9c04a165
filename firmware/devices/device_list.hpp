#pragma once

#include <filesystem>
#include <vector>

#include "firmware/control/control_target.hpp"

namespace trigmesh {

/// The cameras that V4L2 and libcamera know, and after them the GPIO chips. What may not be opened
/// is listed with a note.
[[nodiscard]] std::vector<DeviceInfo> find_devices();

/// The GPIO chips below a folder of device nodes, sorted by name. Nothing when it cannot be read.
[[nodiscard]] std::vector<DeviceInfo> find_gpio_chips(const std::filesystem::path& folder);

}  // namespace trigmesh
