#pragma once

#include <chrono>
#include <ctime>

namespace trigmesh {

/// Where intervals come from, so that tests can say what time it is. Thread-safe.
class Clock {
 public:
  Clock() = default;
  Clock(const Clock&) = delete;
  Clock& operator=(const Clock&) = delete;
  Clock(Clock&&) = delete;
  Clock& operator=(Clock&&) = delete;
  virtual ~Clock() = default;

  /// Monotonic time since an arbitrary start.
  [[nodiscard]] virtual std::chrono::nanoseconds now() const = 0;
};

/// The machine's monotonic clock.
class SteadyClock final : public Clock {
 public:
  [[nodiscard]] std::chrono::nanoseconds now() const override {
    return std::chrono::steady_clock::now().time_since_epoch();
  }
};

/// Processor time that all threads of the process have used so far.
class ProcessCpuClock final : public Clock {
 public:
  [[nodiscard]] std::chrono::nanoseconds now() const override {
    timespec used{};
    ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
    return std::chrono::seconds(used.tv_sec) + std::chrono::nanoseconds(used.tv_nsec);
  }
};

/// What people call the time, for names and manifests only: it may jump in either direction.
/// Thread-safe.
class WallClock {
 public:
  WallClock() = default;
  WallClock(const WallClock&) = delete;
  WallClock& operator=(const WallClock&) = delete;
  WallClock(WallClock&&) = delete;
  WallClock& operator=(WallClock&&) = delete;
  virtual ~WallClock() = default;

  /// Since 1970-01-01 00:00 UTC.
  [[nodiscard]] virtual std::chrono::nanoseconds now() const = 0;
};

/// The machine's clock of the day.
class SystemWallClock final : public WallClock {
 public:
  [[nodiscard]] std::chrono::nanoseconds now() const override {
    return std::chrono::system_clock::now().time_since_epoch();
  }
};

}  // namespace trigmesh
