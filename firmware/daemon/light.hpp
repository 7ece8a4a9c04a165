#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>

#include "drivers/indicator/indicator.hpp"
#include "firmware/base/clock.hpp"
#include "firmware/daemon/guide.hpp"
#include "firmware/daemon/heartbeat.hpp"
#include "firmware/daemon/logging.hpp"
#include "firmware/session/state_machine.hpp"

namespace trigmesh {

/// How the last model or capture ended, until something new begins.
enum class LastOutcome : std::uint8_t { kNone, kDone, kFailed };

/// What the light says; see the table in the README.
[[nodiscard]] IndicatorPattern pattern_of(const RigState& state,
                                          LastOutcome outcome,
                                          Advice advice = Advice::kNone);

/// Opens the light; called again and again until it succeeds.
using IndicatorOpener = std::function<DeviceResult<std::unique_ptr<Indicator>>()>;

/// Plays patterns on an indicator in a thread of its own. set() is thread-safe.
class Light {
 public:
  /// `open` may be empty: there is no light. All of it outlives the light.
  Light(IndicatorOpener open, Faults& faults, Heartbeat& heartbeat, const Clock& clock)
      : open_(std::move(open)), faults_(faults), heartbeat_(heartbeat), clock_(clock) {}

  /// From now on; nothing happens when it is shown already.
  void set(IndicatorPattern pattern);

  /// The thread, until `stop`; dark afterwards.
  void run(const std::stop_token& stop);

 private:
  struct Playing {
    IndicatorPattern pattern = IndicatorPattern::kOff;
    std::chrono::nanoseconds since{};
    std::uint64_t changes = 0;
  };

  [[nodiscard]] Playing playing() const;
  void go_idle(std::uint64_t changes);
  void show(const IndicatorLevels& levels);

  const IndicatorOpener open_;
  Faults& faults_;
  Heartbeat& heartbeat_;
  const Clock& clock_;
  mutable std::mutex mutex_;
  std::condition_variable_any changed_;
  IndicatorPattern wanted_ = IndicatorPattern::kOff;  ///< guarded by mutex_
  Playing playing_;                                   ///< guarded by mutex_
  std::unique_ptr<Indicator> indicator_;  ///< of the thread; nothing until it could be opened
};

}  // namespace trigmesh
