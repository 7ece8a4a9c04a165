#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "drivers/camera/camera_controls.hpp"

namespace trigmesh {

/// Whether a control switches an automatism; the others are steered.
[[nodiscard]] bool is_automatism(ControlId id);

/// The entry of a control; nullptr when there is none.
[[nodiscard]] const ControlValue* find_value(const std::vector<ControlValue>& values, ControlId id);

/// What lock(), check_lock() and the restoring of a lock are for any camera: they are made of
/// list(), get() and set() alone. Remembers what is held. Thread-compatible.
class ControlLock {
 public:
  /// See CameraControls::lock. `camera` is for messages.
  [[nodiscard]] DeviceResult<std::vector<ControlValue>> lock(
      CameraControls& controls, std::string_view camera, const std::vector<ControlValue>& wanted);

  /// See CameraControls::check_lock.
  [[nodiscard]] DeviceResult<> check(CameraControls& controls, std::string_view camera) const;

  /// Sets what is held on a camera that came back, and reads it back; nothing when nothing is held.
  /// kControlRefused: it does not take a value as it did before.
  [[nodiscard]] DeviceResult<> restore(CameraControls& controls, std::string_view camera) const;

  [[nodiscard]] const std::vector<ControlValue>& held() const { return held_; }

 private:
  [[nodiscard]] DeviceResult<> hold(CameraControls& controls, ControlValue value);

  std::vector<ControlValue> held_;
};

}  // namespace trigmesh
