#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <memory>
#include <vector>

#include "drivers/trigger/trigger_source.hpp"
#include "firmware/base/clock.hpp"
#include "firmware/base/result.hpp"

namespace trigmesh {

/// When the next edge of a script is due.
enum class ScriptPace {
  kAsFastAsPossible,  ///< at once
  kRecordedSpeed,     ///< as long after start() as it lies after the origin
  kLockStep,          ///< when release_until() has passed its time: in step with replayed frames
};

struct ScriptOptions {
  ScriptPace pace = ScriptPace::kAsFastAsPossible;
  /// Recorded speed: the time in the script that start() is: that of the first frame.
  std::chrono::nanoseconds origin{0};
};

/// The edges of a recording one after the other, their times untouched.
class ScriptedTrigger final : public TriggerSource {
 public:
  /// `edges` in the order of time; `clock` outlives the source. kIo: the system has no descriptors
  /// left.
  [[nodiscard]] static Result<std::unique_ptr<ScriptedTrigger>> create(
      std::vector<TriggerEdge> edges, const ScriptOptions& options, const Clock& clock);

  /// The first edge again when it was stopped. What was released stays released.
  [[nodiscard]] DeviceResult<> start() override;
  void stop() override;
  [[nodiscard]] TriggerEvent wait(std::chrono::nanoseconds timeout) override;

  void request_stop() noexcept override { stop_requested_.set(); }

  /// Lock step: lets edges up to and with `time` go. Never goes back. Thread-safe.
  void release_until(std::chrono::nanoseconds time) noexcept;

 private:
  ScriptedTrigger(std::vector<TriggerEdge> edges, const ScriptOptions& options, const Clock& clock);

  /// How long until the next edge is due; 0: now; the longest time: not known.
  [[nodiscard]] std::chrono::nanoseconds time_left() const;

  const std::vector<TriggerEdge> edges_;
  const ScriptOptions options_;
  const Clock& clock_;
  WakeEvent stop_requested_;
  WakeEvent released_;
  std::atomic<std::int64_t> released_until_ns_;
  bool is_running_ = false;
  std::size_t next_index_ = 0;
  std::chrono::nanoseconds start_time_{0};
};

}  // namespace trigmesh
