#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>

#include "drivers/camera/camera_controls.hpp"
#include "drivers/camera/frame.hpp"
#include "drivers/device/device_fault.hpp"
#include "drivers/device/wake_event.hpp"

namespace trigmesh {

/// There are no more frames: the end of a recording. A camera has none.
struct EndOfFrames {};

/// What one wait brought: exactly one of these.
using FrameEvent = std::variant<Frame, EndOfFrames, WaitStopped, DeviceFault>;

/// What a source turned out to be.
struct SourceInfo {
  /// What finds it again after it was unplugged: a name that does not depend on the order in which
  /// devices appeared. Recordings: their path.
  std::string stable_name;
  std::string model;   ///< as it calls itself
  FrameLayout layout;  ///< what start() agreed on; encoded without size when frames may differ
  std::chrono::nanoseconds frame_interval{0};  ///< 0: not known
  std::size_t buffer_count = 0;  ///< frames that may be held at once before the source starves
};

/// What happened since the source was made.
struct FrameCounters {
  std::uint64_t frames = 0;  ///< delivered
  std::uint64_t missed = 0;  ///< lost before they reached us, by sequence numbers
  FaultCounters faults;
};

/// Where frames come from: a camera, a folder of photographs, a recorded session. Used as
///
///     TM_RETURN_IF_FAULT(source.start());
///     while (true) {
///       FrameEvent event = source.wait(2s);
///       if (auto* frame = std::get_if<Frame>(&event)) { use(std::move(*frame)); continue; }
///       if (auto* fault = std::get_if<DeviceFault>(&event)) { act on fault_policy(fault->kind) }
///       else break;                                  // the end, or asked to stop
///     }
///     source.stop();
///
/// Threads: one thread at a time calls start, wait, stop and the rest. request_stop() may be called
/// from any thread at any time, and frames may be released on any thread at any time, also after
/// the source is gone. In steady state wait() takes no memory from the heap.
class FrameSource {
 public:
  FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;
  FrameSource(FrameSource&&) = delete;
  FrameSource& operator=(FrameSource&&) = delete;
  virtual ~FrameSource() = default;

  /// Opens the device and lets it run; a recording begins at its first frame. Nothing happens when
  /// it runs already. After a fault it is as before: stopped, with nothing open.
  [[nodiscard]] virtual DeviceResult<> start() = 0;

  /// Ends the stream and closes the device; frames that are out stay readable. Forgets a
  /// request_stop(). Nothing happens when it does not run.
  virtual void stop() = 0;

  /// The next frame in capture order, or why there is none. A fault concerns this frame alone when
  /// its policy is kContinue, or says that nothing came in time (kTimeout): waiting again goes on.
  /// After any other fault every wait says kNotStarted until stop() and start().
  /// A frame that is ready is delivered also when `timeout` is 0. When all buffers are out, a
  /// camera loses frames, and a recording waits.
  [[nodiscard]] virtual FrameEvent wait(std::chrono::nanoseconds timeout) = 0;

  /// Ends a wait in another thread at once, and all later ones, until stop(). Thread-safe.
  virtual void request_stop() noexcept = 0;

  /// Complete after start(); before it, what is known.
  [[nodiscard]] virtual SourceInfo info() const = 0;

  [[nodiscard]] virtual FrameCounters counters() const = 0;

  /// Exposure, gain and the like; nullptr when there is nothing to control. Valid until the source
  /// goes; its calls need a started source.
  [[nodiscard]] virtual CameraControls* controls() { return nullptr; }
};

}  // namespace trigmesh
