#pragma once

#include <chrono>
#include <cstdint>
#include <variant>

#include "drivers/device/device_fault.hpp"
#include "drivers/device/wake_event.hpp"

namespace trigmesh {

/// What a button did.
enum class TriggerAction : std::uint8_t { kPressed, kReleased };

/// A press or release as the operator meant it: free of bounce.
struct TriggerEdge {
  /// When the contact first moved: CLOCK_MONOTONIC as the kernel stamped it, or the clock of the
  /// recording. Comparable with the timestamps of frames from the same place.
  std::chrono::nanoseconds timestamp{0};
  std::uint32_t button = 0;  ///< 0: capture; more as the settings number them
  TriggerAction action = TriggerAction::kPressed;

  bool operator==(const TriggerEdge&) const = default;
};

/// Nobody pressed anything in the time given.
struct NoTrigger {};

/// There are no more edges: the end of a recording.
struct EndOfTriggers {};

/// What one wait brought: exactly one of these.
using TriggerEvent = std::variant<TriggerEdge, NoTrigger, EndOfTriggers, WaitStopped, DeviceFault>;

/// Where presses come from: buttons, a recording, commands. Edges of one button alternate,
/// beginning with a press, and come in the order of time. None is ever dropped by us.
///
/// Threads: one thread at a time calls start, wait and stop; request_stop() may be called from any
/// thread at any time.
class TriggerSource {
 public:
  TriggerSource() = default;
  TriggerSource(const TriggerSource&) = delete;
  TriggerSource& operator=(const TriggerSource&) = delete;
  TriggerSource(TriggerSource&&) = delete;
  TriggerSource& operator=(TriggerSource&&) = delete;
  virtual ~TriggerSource() = default;

  /// Opens the device. A button that is held down meanwhile counts from its next press on. Nothing
  /// happens when it runs already; after a fault nothing is open.
  [[nodiscard]] virtual DeviceResult<> start() = 0;

  /// Closes the device. Forgets a request_stop().
  virtual void stop() = 0;

  /// The next edge, or why there is none. After a fault every wait says kNotStarted until stop()
  /// and start().
  [[nodiscard]] virtual TriggerEvent wait(std::chrono::nanoseconds timeout) = 0;

  /// Ends a wait in another thread at once, and all later ones, until stop(). Thread-safe.
  virtual void request_stop() noexcept = 0;
};

}  // namespace trigmesh
