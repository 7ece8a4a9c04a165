#pragma once

#include <chrono>
#include <optional>
#include <string>

#include <signal.h>

#include "firmware/base/clock.hpp"
#include "firmware/base/unique_fd.hpp"
#include "firmware/daemon/daemon.hpp"

namespace trigmesh {

/// What the service manager is told. Without one (NOTIFY_SOCKET) nothing happens.
class ServiceManager {
 public:
  void ready();
  void stopping();
  void status(const std::string& text);  ///< only when it differs from the last one
  void watchdog();

  /// How often it wants to hear of us; nothing: never.
  [[nodiscard]] static std::optional<std::chrono::microseconds> watchdog_interval();

 private:
  std::string status_;
};

/// Whether the rig gets on: every thread has turned its loop lately, and the model that is made has
/// made progress.
class RigWatch {
 public:
  /// `turn_limit`: longest time between two turns of a thread. `stall_limit`: longest time without
  /// progress on a model. `daemon` outlives it.
  RigWatch(const Daemon& daemon,
           std::chrono::nanoseconds turn_limit,
           std::chrono::nanoseconds stall_limit)
      : daemon_(daemon), turn_limit_(turn_limit), progress_(stall_limit) {}

  /// What does not get on, a sentence; nothing: all is well.
  [[nodiscard]] std::optional<std::string> trouble(std::chrono::nanoseconds now);

 private:
  const Daemon& daemon_;
  std::chrono::nanoseconds turn_limit_;
  ProgressWatch progress_;
};

/// SIGTERM and SIGINT as a descriptor that can be polled. Made in the main thread before all
/// others, which inherit that these signals are blocked.
class EndSignals {
 public:
  EndSignals();

  /// Whether the system had a descriptor for it.
  [[nodiscard]] bool valid() const { return fd_.valid(); }

  [[nodiscard]] int fd() const { return fd_.get(); }

 private:
  UniqueFd fd_;
};

/// The life of the service in its main thread: tells the service manager when the rig is ready and
/// that it gets on, and ends it in order at the first signal. Returns when everything is closed.
void serve(Daemon& daemon, const EndSignals& signals, RigWatch& watch, const Clock& clock);

}  // namespace trigmesh
