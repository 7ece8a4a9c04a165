#pragma once

#include <chrono>
#include <span>

#include <poll.h>

#include "drivers/device/device_fault.hpp"
#include "firmware/base/clock.hpp"
#include "firmware/base/unique_fd.hpp"

namespace trigmesh {

/// request_stop() ended the wait for a device.
struct WaitStopped {};

/// A flag that a blocked wait can poll: set by one thread, seen at once by another. Thread-safe.
class WakeEvent {
 public:
  WakeEvent();

  /// Whether the system had a descriptor for it. Everything else needs this to be true.
  [[nodiscard]] bool valid() const { return fd_.valid(); }

  /// Readable while the flag is set. Owned by this object.
  [[nodiscard]] int fd() const { return fd_.get(); }

  void set() noexcept;
  void clear() noexcept;
  [[nodiscard]] bool is_set() const noexcept;

 private:
  UniqueFd fd_;
};

/// poll(2) that goes on after a signal for what is left of the time. Returns the number of ready
/// descriptors, 0 when the time is over, or a negative errno. Rounds up to whole milliseconds, so
/// that it never returns early. A negative timeout counts as 0.
[[nodiscard]] int poll_until(std::span<pollfd> descriptors,
                             std::chrono::nanoseconds timeout,
                             const Clock& clock);

/// The milliseconds for poll(2): rounded up, within what an int holds, not negative.
[[nodiscard]] int poll_milliseconds(std::chrono::nanoseconds timeout);

/// `now` + `timeout`, or the end of time where that is later: a caller may wait for ever.
[[nodiscard]] std::chrono::nanoseconds deadline_after(std::chrono::nanoseconds now,
                                                      std::chrono::nanoseconds timeout);

}  // namespace trigmesh
