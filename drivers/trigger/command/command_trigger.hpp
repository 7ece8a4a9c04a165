#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>

#include "drivers/trigger/trigger_source.hpp"
#include "firmware/base/clock.hpp"
#include "firmware/base/result.hpp"

namespace trigmesh {

/// Presses that the program makes itself, for a rig without buttons.
class CommandTrigger final : public TriggerSource {
 public:
  /// Edges that may wait to be taken.
  static constexpr std::size_t kMostWaiting = 256;

  /// `clock` is that of the kernel's timestamps (SteadyClock) and outlives the source. kIo: the
  /// system has no descriptors left.
  [[nodiscard]] static Result<std::unique_ptr<CommandTrigger>> create(const Clock& clock);

  /// Adds an edge that happens now. Thread-safe. kInvalidArgument: the button is pressed already,
  /// or is not pressed; kLimitExceeded: kMostWaiting edges were not taken yet.
  [[nodiscard]] Result<> inject(std::uint32_t button, TriggerAction action);

  [[nodiscard]] DeviceResult<> start() override;

  /// Edges that were not taken are forgotten, and all buttons are released.
  void stop() override;
  [[nodiscard]] TriggerEvent wait(std::chrono::nanoseconds timeout) override;

  void request_stop() noexcept override { stop_requested_.set(); }

 private:
  explicit CommandTrigger(const Clock& clock) : clock_(clock) {}

  const Clock& clock_;
  WakeEvent stop_requested_;
  WakeEvent injected_;
  bool is_running_ = false;
  std::mutex mutex_;
  std::deque<TriggerEdge> waiting_;                      ///< guarded by mutex_
  std::map<std::uint32_t, TriggerAction> last_actions_;  ///< guarded by mutex_
};

}  // namespace trigmesh
