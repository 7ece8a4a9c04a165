#include "drivers/camera/mock/mock_source.hpp"

#include <utility>

#include <poll.h>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

std::shared_ptr<const MockScript> prepare(MockScript script) {
  TM_CHECK(script.buffer_count > 0);
  script.info.buffer_count = script.buffer_count;
  return std::make_shared<const MockScript>(std::move(script));
}

}  // namespace

MockFrameSource::MockFrameSource(MockScript script, const Clock& clock)
    : script_(prepare(std::move(script))),
      clock_(clock),
      pool_(std::make_shared<SlotPool>(script_->buffer_count, script_)) {
  TM_CHECK(stop_requested_.valid());
}

DeviceResult<> MockFrameSource::start() {
  if (is_running_) {
    return {};
  }
  const std::size_t call = start_count_++;
  if (call < script_->starts.size() && script_->starts[call]) {
    const FaultKind kind = *script_->starts[call];
    counters_.faults.add(kind);
    return device_fault(kind, "cannot start the mock camera: {}", to_string(kind));
  }
  is_running_ = true;
  next_sequence_ = 0;
  missed_ = 0;
  return {};
}

void MockFrameSource::stop() {
  is_running_ = false;
  stop_requested_.clear();
}

FrameEvent MockFrameSource::wait(std::chrono::nanoseconds timeout) {
  while (true) {
    if (stop_requested_.is_set()) {
      return WaitStopped{};
    }
    if (!is_running_) {
      return refuse(FaultKind::kNotStarted, "cannot wait for a frame: the camera is not started");
    }
    if (next_step_ == script_->steps.size()) {
      return stay_silent(timeout);
    }
    const MockStep& step = script_->steps[next_step_];
    if (std::holds_alternative<MockEnd>(step)) {
      return EndOfFrames{};
    }
    ++next_step_;
    if (std::holds_alternative<MockSilence>(step)) {
      return stay_silent(timeout);
    }
    if (const auto* fault = std::get_if<MockFault>(&step)) {
      return play(*fault);
    }
    if (std::optional<FrameEvent> event = play(std::get<MockFrame>(step))) {
      return *std::move(event);
    }
  }
}

std::optional<FrameEvent> MockFrameSource::play(const MockFrame& step) {
  next_sequence_ += step.lost_before;
  missed_ += step.lost_before;
  const std::uint64_t sequence = next_sequence_++;
  const std::optional<std::size_t> slot = pool_->take();
  if (!slot) {
    ++missed_;
    return std::nullopt;
  }
  std::vector<std::uint8_t>& buffer = pool_->bytes(*slot);
  buffer.assign(step.bytes.begin(), step.bytes.end());
  FrameInfo info;
  info.timestamp = step.timestamp;
  info.sequence = sequence;
  info.missed_before = std::exchange(missed_, 0);
  info.layout = step.layout;
  ++counters_.frames;
  counters_.missed += info.missed_before;
  if (info.missed_before > 0) {
    counters_.faults.add(FaultKind::kGap);
  }
  return Frame(info, buffer, pool_, *slot);
}

FrameEvent MockFrameSource::play(const MockFault& step) {
  const FaultAction action = fault_policy(step.kind).action;
  is_running_ = action == FaultAction::kContinue || step.kind == FaultKind::kTimeout;
  if (step.kind == FaultKind::kCorruptFrame || step.kind == FaultKind::kShortFrame) {
    ++next_sequence_;
  }
  return refuse(step.kind, fmt::format("the mock camera says: {}", to_string(step.kind)));
}

FrameEvent MockFrameSource::stay_silent(std::chrono::nanoseconds timeout) {
  pollfd entry{stop_requested_.fd(), POLLIN, 0};
  if (poll_until({&entry, 1}, timeout, clock_) > 0) {
    return WaitStopped{};
  }
  return refuse(FaultKind::kTimeout, "no frame from the mock camera in the time given");
}

FrameEvent MockFrameSource::refuse(FaultKind kind, std::string message) {
  counters_.faults.add(kind);
  return DeviceFault{kind, std::move(message)};
}

}  // namespace trigmesh
