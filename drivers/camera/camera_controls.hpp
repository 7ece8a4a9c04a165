#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "drivers/device/device_fault.hpp"

namespace trigmesh {

/// What can be steered. Units are the device's own where cameras do not agree on any.
enum class ControlId : std::uint8_t {
  kExposureAuto,      ///< 1: the camera chooses, 0: kExposure holds
  kExposure,          ///< microseconds
  kGainAuto,          ///< 1 or 0
  kGain,              ///< units of the device; larger is brighter
  kWhiteBalanceAuto,  ///< 1 or 0
  kWhiteBalance,      ///< kelvin, or the red gain where the device has gains
  kFocusAuto,         ///< 1 or 0
  kFocus,             ///< units of the device; larger is nearer
};

/// "exposure", "white balance automatic", ...: stable.
[[nodiscard]] std::string_view to_string(ControlId id);

/// What values a control takes.
struct ControlRange {
  ControlId id = ControlId::kExposure;
  std::int64_t minimum = 0;
  std::int64_t maximum = 0;
  std::int64_t step = 1;
  std::int64_t standard = 0;  ///< the device's default
  /// The device's numbers in one unit that people use: a gain of 1, 1 dioptre, 1 kelvin. 0: it
  /// counts something else. 1 also where its unit is not known.
  std::int64_t per_unit = 1;
};

/// A control and the value it has.
struct ControlValue {
  ControlId id = ControlId::kExposure;
  std::int64_t value = 0;

  bool operator==(const ControlValue&) const = default;
};

/// The settings of a camera while it runs. Used on the thread of its FrameSource.
class CameraControls {
 public:
  CameraControls() = default;
  CameraControls(const CameraControls&) = delete;
  CameraControls& operator=(const CameraControls&) = delete;
  CameraControls(CameraControls&&) = delete;
  CameraControls& operator=(CameraControls&&) = delete;
  virtual ~CameraControls() = default;

  /// The controls that the camera has, in the order of ControlId.
  [[nodiscard]] virtual DeviceResult<std::vector<ControlRange>> list() = 0;

  /// kControlRefused: the camera has no such control.
  [[nodiscard]] virtual DeviceResult<std::int64_t> get(ControlId id) = 0;

  /// Sets and reads back; returns what the camera took, which may be a step of its own beside
  /// `value`. kControlRefused: no such control, out of range, or an automatism that did not switch.
  [[nodiscard]] virtual DeviceResult<std::int64_t> set(ControlId id, std::int64_t value) = 0;

  /// Holds for a session what the camera chose by itself: each automatism goes off, and the value
  /// it had is written and read back. A value in `wanted` replaces what the camera chose. Returns
  /// what holds now, in the order of ControlId; controls that the camera does not have are left
  /// out. It lasts until the next lock(): a camera that comes back is set to it by start().
  /// kControlRefused: an automatism stays on, a value is out of range, or `wanted` names a control
  /// that the camera does not have or an automatism.
  [[nodiscard]] virtual DeviceResult<std::vector<ControlValue>> lock(
      const std::vector<ControlValue>& wanted) = 0;

  /// Compares with what lock() returned; kControlRefused names the first control that drifted.
  [[nodiscard]] virtual DeviceResult<> check_lock() = 0;
};

}  // namespace trigmesh
