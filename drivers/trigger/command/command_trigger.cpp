#include "drivers/trigger/command/command_trigger.hpp"

#include <array>

#include <poll.h>

namespace trigmesh {

Result<std::unique_ptr<CommandTrigger>> CommandTrigger::create(const Clock& clock) {
  std::unique_ptr<CommandTrigger> trigger(new CommandTrigger(clock));
  if (!trigger->stop_requested_.valid() || !trigger->injected_.valid()) {
    return fail(ErrorCode::kIo, "cannot take commands: the system has no file descriptors left");
  }
  return trigger;
}

Result<> CommandTrigger::inject(std::uint32_t button, TriggerAction action) {
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() == kMostWaiting) {
      return fail(ErrorCode::kLimitExceeded,
                  "cannot press button {}: {} presses and releases are not worked off yet",
                  button,
                  kMostWaiting);
    }
    const auto known = last_actions_.find(button);
    const bool is_pressed =
        known != last_actions_.end() && known->second == TriggerAction::kPressed;
    if (is_pressed == (action == TriggerAction::kPressed)) {
      return fail(ErrorCode::kInvalidArgument,
                  "button {} is {}",
                  button,
                  is_pressed ? "pressed already" : "not pressed");
    }
    last_actions_[button] = action;
    waiting_.push_back({clock_.now(), button, action});
  }
  injected_.set();
  return {};
}

DeviceResult<> CommandTrigger::start() {
  is_running_ = true;
  return {};
}

void CommandTrigger::stop() {
  is_running_ = false;
  stop_requested_.clear();
  const std::lock_guard lock(mutex_);
  waiting_.clear();
  last_actions_.clear();
}

TriggerEvent CommandTrigger::wait(std::chrono::nanoseconds timeout) {
  const std::chrono::nanoseconds deadline = deadline_after(clock_.now(), timeout);
  while (true) {
    if (stop_requested_.is_set()) {
      return WaitStopped{};
    }
    if (!is_running_) {
      return DeviceFault{FaultKind::kNotStarted, "cannot wait for a press: it is not started"};
    }
    injected_.clear();  // before looking, so that no edge is missed
    {
      const std::lock_guard lock(mutex_);
      if (!waiting_.empty()) {
        const TriggerEdge edge = waiting_.front();
        waiting_.pop_front();
        return edge;
      }
    }
    const std::chrono::nanoseconds now = clock_.now();
    if (now >= deadline) {
      return NoTrigger{};
    }
    std::array<pollfd, 2> entries = {pollfd{stop_requested_.fd(), POLLIN, 0},
                                     pollfd{injected_.fd(), POLLIN, 0}};
    if (const int ready = poll_until(entries, deadline - now, clock_); ready < 0) {
      return fault_of_errno(-ready, "cannot wait for", "commands");
    }
  }
}

}  // namespace trigmesh
