#include "drivers/trigger/scripted/scripted_trigger.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include <poll.h>

namespace trigmesh {

Result<std::unique_ptr<ScriptedTrigger>> ScriptedTrigger::create(std::vector<TriggerEdge> edges,
                                                                 const ScriptOptions& options,
                                                                 const Clock& clock) {
  std::unique_ptr<ScriptedTrigger> trigger(new ScriptedTrigger(std::move(edges), options, clock));
  if (!trigger->stop_requested_.valid() || !trigger->released_.valid()) {
    return fail(ErrorCode::kIo, "cannot replay presses: the system has no file descriptors left");
  }
  return trigger;
}

ScriptedTrigger::ScriptedTrigger(std::vector<TriggerEdge> edges,
                                 const ScriptOptions& options,
                                 const Clock& clock)
    : edges_(std::move(edges)),
      options_(options),
      clock_(clock),
      released_until_ns_(std::numeric_limits<std::int64_t>::min()) {}

DeviceResult<> ScriptedTrigger::start() {
  if (!is_running_) {
    is_running_ = true;
    next_index_ = 0;
    start_time_ = clock_.now();
  }
  return {};
}

void ScriptedTrigger::stop() {
  is_running_ = false;
  stop_requested_.clear();
}

void ScriptedTrigger::release_until(std::chrono::nanoseconds time) noexcept {
  std::int64_t before = released_until_ns_.load();
  while (before < time.count() && !released_until_ns_.compare_exchange_weak(before, time.count())) {
  }
  released_.set();
}

std::chrono::nanoseconds ScriptedTrigger::time_left() const {
  using std::chrono::nanoseconds;
  const nanoseconds time = edges_[next_index_].timestamp;
  switch (options_.pace) {
    case ScriptPace::kAsFastAsPossible:
      break;
    case ScriptPace::kRecordedSpeed:
      return std::max(nanoseconds(0), start_time_ + (time - options_.origin) - clock_.now());
    case ScriptPace::kLockStep:
      return time.count() <= released_until_ns_.load() ? nanoseconds(0) : nanoseconds::max();
  }
  return nanoseconds(0);
}

TriggerEvent ScriptedTrigger::wait(std::chrono::nanoseconds timeout) {
  const std::chrono::nanoseconds deadline = deadline_after(clock_.now(), timeout);
  while (true) {
    if (stop_requested_.is_set()) {
      return WaitStopped{};
    }
    if (!is_running_) {
      return DeviceFault{FaultKind::kNotStarted, "cannot wait for a press: it is not started"};
    }
    if (next_index_ == edges_.size()) {
      return EndOfTriggers{};
    }
    released_.clear();  // before looking, so that no release is missed
    const std::chrono::nanoseconds left = time_left();
    if (left.count() == 0) {
      return edges_[next_index_++];
    }
    const std::chrono::nanoseconds now = clock_.now();
    if (now >= deadline) {
      return NoTrigger{};
    }
    std::array<pollfd, 2> entries = {pollfd{stop_requested_.fd(), POLLIN, 0},
                                     pollfd{released_.fd(), POLLIN, 0}};
    if (const int ready = poll_until(entries, std::min(left, deadline - now), clock_); ready < 0) {
      return fault_of_errno(-ready, "cannot wait for", "presses of a recording");
    }
  }
}

}  // namespace trigmesh
