#pragma once

#include <optional>

#include "drivers/camera/camera_controls.hpp"
#include "drivers/camera/libcamera/told_controls.hpp"

namespace libcamera {
class ControlInfoMap;
class ControlList;
}  // namespace libcamera

namespace trigmesh {

/// What values a control of a camera takes; nothing when the camera does not have it. Exposure and
/// gain have one automatism in libcamera, AeEnable: it is kExposureAuto, and there is no kGainAuto.
[[nodiscard]] std::optional<ControlRange> range_of(const libcamera::ControlInfoMap& camera,
                                                   ControlId id);

/// Adds a control to what a request carries. `blue_gain` goes with the red one of kWhiteBalance.
void write_control(libcamera::ControlList& request, ControlValue control, float blue_gain);

/// What a completed request tells in its metadata.
[[nodiscard]] ToldControls read_controls(const libcamera::ControlList& metadata);

}  // namespace trigmesh
