#pragma once

#include <algorithm>
#include <chrono>
#include <vector>

#include "firmware/base/clock.hpp"
#include "firmware/pipeline/progress.hpp"

namespace trigmesh {

/// Time spent in each stage, for timings.json; never part of the model.
struct StageTime {
  Stage stage = Stage::kExtract;
  std::chrono::nanoseconds duration{};
  std::chrono::nanoseconds cpu_time{};  ///< of all threads
};

/// Measures the stages one after the other. `clock` outlives it.
class Stopwatch {
 public:
  explicit Stopwatch(const Clock& clock)
      : clock_(&clock), last_(clock.now()), last_cpu_(cpu_clock_.now()) {}

  /// The time since the stage before ended belongs to `stage`, which may come again.
  void finish(Stage stage) {
    const auto now = clock_->now();
    const auto cpu = cpu_clock_.now();
    auto time = std::find_if(
        times_.begin(), times_.end(), [&](const StageTime& one) { return one.stage == stage; });
    if (time == times_.end()) {
      time = times_.insert(times_.end(), StageTime{stage, {}, {}});
    }
    time->duration += now - last_;
    time->cpu_time += cpu - last_cpu_;
    last_ = now;
    last_cpu_ = cpu;
  }

  [[nodiscard]] std::vector<StageTime> times() const { return times_; }

 private:
  const Clock* clock_;
  ProcessCpuClock cpu_clock_;
  std::chrono::nanoseconds last_;
  std::chrono::nanoseconds last_cpu_;
  std::vector<StageTime> times_;
};

}  // namespace trigmesh
