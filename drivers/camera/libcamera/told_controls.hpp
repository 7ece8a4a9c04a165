#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/camera/camera_controls.hpp"

namespace trigmesh {

/// What a completed frame tells of the controls that it was taken with, by ControlId and in our
/// units; nothing where the camera does not tell.
struct ToldControls {
  std::array<std::optional<std::int64_t>, 8> values;
  /// White balance is two gains in libcamera and one number in ours, the red one.
  std::optional<float> blue_gain;

  [[nodiscard]] std::optional<std::int64_t>& operator[](ControlId id) {
    return values[static_cast<std::size_t>(id)];
  }

  [[nodiscard]] const std::optional<std::int64_t>& operator[](ControlId id) const {
    return values[static_cast<std::size_t>(id)];
  }
};

}  // namespace trigmesh
