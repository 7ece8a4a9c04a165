#pragma once

#include <string>
#include <utility>
#include <vector>

#include "drivers/camera/camera_controls.hpp"

namespace trigmesh {

/// A control and what it shall be, in the units of the settings: microseconds, factor, kelvin,
/// dioptres. Cameras that count in units of their own get the number as it is.
struct WantedControl {
  ControlId id = ControlId::kExposure;
  double value = 0.0;
};

/// What the operator wants of the camera's automatisms.
struct CameraHoldOptions {
  /// Replaces what the camera would choose: exposure, gain, white balance, focus.
  std::vector<WantedControl> wanted;
  /// false: the automatisms go on during a session.
  bool locks = true;
};

/// Exposure, gain, white balance and focus of a camera, held during a session. What a camera
/// refuses is told and is no failure: pictures with automatic exposure are better than none.
/// Used on the thread of the camera.
class CameraHold {
 public:
  explicit CameraHold(CameraHoldOptions options) : options_(std::move(options)) {}

  /// The camera was started, perhaps for the first time: sets the wanted values, and gives the
  /// automatisms free that a lock of an earlier session still holds. What was refused, a sentence
  /// each. `controls` may be null: nothing to do, also below.
  [[nodiscard]] std::vector<std::string> on_camera_start(CameraControls* controls);

  /// A session begins.
  [[nodiscard]] std::vector<std::string> hold(CameraControls* controls);

  /// What drifted from what was held; empty: nothing.
  [[nodiscard]] std::vector<std::string> check(CameraControls* controls);

  /// The session is over: the automatisms that the settings leave to the camera are on again.
  [[nodiscard]] std::vector<std::string> release(CameraControls* controls);

  [[nodiscard]] bool is_holding() const { return is_holding_; }

 private:
  [[nodiscard]] std::vector<std::string> free_automatisms(CameraControls& controls);
  [[nodiscard]] bool is_wanted(ControlId id) const;
  /// Those that the camera has, in its units; the others are told.
  [[nodiscard]] std::vector<ControlValue> wanted_of(const std::vector<ControlRange>& ranges,
                                                    std::vector<std::string>& refused) const;

  CameraHoldOptions options_;
  bool is_holding_ = false;
  bool was_held_ = false;  ///< a camera that comes back is locked by start()
};

}  // namespace trigmesh
