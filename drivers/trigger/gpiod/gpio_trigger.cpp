#include "drivers/trigger/gpiod/gpio_trigger.hpp"

#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include <poll.h>

namespace trigmesh {
namespace {

constexpr std::chrono::milliseconds kLongestSettle{100};

TriggerAction action_of(GpioLevel level) {
  return level == GpioLevel::kActive ? TriggerAction::kPressed : TriggerAction::kReleased;
}

}  // namespace

Result<> GpioTriggerOptions::validate() const {
  std::set<std::uint32_t> numbers;
  for (const GpioButton& button : buttons) {
    numbers.insert(button.button);
  }
  if (buttons.empty() || numbers.size() != buttons.size()) {
    return fail(ErrorCode::kInvalidArgument,
                "{} buttons with {} numbers: at least one button, and each number once",
                buttons.size(),
                numbers.size());
  }
  if (settle.count() < 0 || settle > kLongestSettle) {
    return fail(ErrorCode::kInvalidArgument,
                "settle is {} ms, must be in [0, {}]",
                settle.count(),
                kLongestSettle.count());
  }
  return {};
}

Result<std::unique_ptr<GpioTrigger>> GpioTrigger::create(GpioTriggerOptions options,
                                                         GpioOpener open,
                                                         const Clock& clock) {
  TM_RETURN_IF_ERROR(options.validate());
  std::unique_ptr<GpioTrigger> trigger(new GpioTrigger(std::move(options), std::move(open), clock));
  if (!trigger->stop_requested_.valid()) {
    return fail(ErrorCode::kIo, "cannot use buttons: the system has no file descriptors left");
  }
  return trigger;
}

GpioTrigger::GpioTrigger(GpioTriggerOptions options, GpioOpener open, const Clock& clock)
    : options_(std::move(options)), open_(std::move(open)), clock_(clock) {}

DeviceResult<> GpioTrigger::start() {
  if (!lines_.empty()) {
    return {};
  }
  std::vector<Line> lines;
  for (const GpioButton& button : options_.buttons) {
    TM_ASSIGN_OR_FAULT(std::unique_ptr<GpioInput> input, open_(button.line));
    TM_ASSIGN_OR_FAULT(const GpioLevel level, input->level());
    lines.push_back(
        {button.button, std::move(input), Debouncer(options_.settle, action_of(level))});
  }
  lines_ = std::move(lines);
  return {};
}

void GpioTrigger::stop() {
  stop_requested_.clear();
  close_lines();
}

void GpioTrigger::close_lines() {
  suppressed_before_ = suppressed_count();
  lines_.clear();
  ready_.clear();
}

std::uint64_t GpioTrigger::suppressed_count() const {
  std::uint64_t count = suppressed_before_;
  for (const Line& line : lines_) {
    count += line.debouncer.suppressed_count();
  }
  return count;
}

TriggerEvent GpioTrigger::wait(std::chrono::nanoseconds timeout) {
  const std::chrono::nanoseconds deadline = deadline_after(clock_.now(), timeout);
  bool has_looked = false;
  while (true) {
    if (stop_requested_.is_set()) {
      return WaitStopped{};
    }
    if (lines_.empty()) {
      return DeviceFault{FaultKind::kNotStarted, "cannot wait for a press: it is not started"};
    }
    if (!ready_.empty()) {
      const TriggerEdge edge = ready_.front();
      ready_.pop_front();
      return edge;
    }
    if (has_looked && clock_.now() >= deadline) {
      return NoTrigger{};
    }
    has_looked = true;
    if (DeviceResult<> looked = look(deadline); !looked) {
      close_lines();
      return std::move(looked).error();
    }
  }
}

/// One poll until something happens, a line settles or the time is over.
DeviceResult<> GpioTrigger::look(std::chrono::nanoseconds until) {
  std::vector<pollfd> entries = {pollfd{stop_requested_.fd(), POLLIN, 0}};
  for (const Line& line : lines_) {
    entries.push_back({line.input->fd(), POLLIN, 0});
    until = std::min(until, line.debouncer.deadline().value_or(until));
  }
  const int ready = poll_until(entries, until - clock_.now(), clock_);
  if (ready < 0) {
    return tl::unexpected<DeviceFault>(fault_of_errno(-ready, "cannot wait for", "buttons"));
  }
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    const short events = entries[i + 1].revents;
    if ((events & POLLIN) != 0) {
      TM_RETURN_IF_FAULT(read_edges(lines_[i]));
    } else if (events != 0) {
      return device_fault(FaultKind::kDisconnected,
                          "the chip of GPIO line {} of {} is gone",
                          options_.buttons[i].line.line,
                          options_.buttons[i].line.chip);
    }
    TM_RETURN_IF_FAULT(settle(lines_[i]));
  }
  // Of several buttons at once, the first that moved comes first.
  std::stable_sort(ready_.begin(), ready_.end(), [](const TriggerEdge& a, const TriggerEdge& b) {
    return a.timestamp < b.timestamp;
  });
  return {};
}

DeviceResult<> GpioTrigger::read_edges(Line& line) {
  std::array<GpioEdge, 16> edges;
  TM_ASSIGN_OR_FAULT(const std::size_t count, line.input->read(edges));
  for (std::size_t i = 0; i < count; ++i) {
    add(line, line.debouncer.feed(edges[i].timestamp, action_of(edges[i].level)));
  }
  return {};
}

DeviceResult<> GpioTrigger::settle(Line& line) {
  const std::chrono::nanoseconds now = clock_.now();
  const std::optional<std::chrono::nanoseconds> deadline = line.debouncer.deadline();
  if (!deadline || now < *deadline) {
    return {};
  }
  // The kernel's queue is short: after a burst the line itself says where it came to rest.
  TM_ASSIGN_OR_FAULT(const GpioLevel level, line.input->level());
  if (action_of(level) != line.debouncer.last()) {
    // Not settled: an edge was lost, or one is on its way to us.
    add(line, line.debouncer.feed(*deadline - std::chrono::nanoseconds(1), action_of(level)));
    return {};
  }
  add(line, line.debouncer.settle(now));
  return {};
}

void GpioTrigger::add(Line& line, std::optional<TriggerEdge> edge) {
  if (!edge) {
    return;
  }
  // The first edge of a button that was held at the start is a release of a press that nobody told.
  const bool is_press = edge->action == TriggerAction::kPressed;
  if (is_press != line.is_pressed) {
    line.is_pressed = is_press;
    edge->button = line.button;
    ready_.push_back(*edge);
  }
}

}  // namespace trigmesh
