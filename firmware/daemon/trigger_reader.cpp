#include "firmware/daemon/trigger_reader.hpp"

#include <algorithm>
#include <condition_variable>
#include <mutex>

namespace trigmesh {
namespace {

using std::chrono::nanoseconds;

/// How long the thread waits before it shows that it lives.
constexpr std::chrono::milliseconds kTurn(500);

}  // namespace

void TriggerReader::run(const std::stop_token& stop) {
  const std::stop_callback wake(stop, [this] { parts_.source.request_stop(); });
  while (!stop.stop_requested()) {
    parts_.heartbeat.beat();
    std::optional<DeviceFault> fault;
    if (const auto started = parts_.source.start(); !started) {
      fault = started.error();
    } else {
      parts_.faults.clear("trigger");
      fault = read_edges(stop);
      parts_.source.stop();
    }
    if (fault) {
      parts_.faults.report("trigger", fault->message);
      wait_to_retry(stop, retries_.delay_after(fault->kind));
    } else {
      wait_to_retry(stop, nanoseconds::max());  // a script has ended
    }
  }
}

std::optional<DeviceFault> TriggerReader::read_edges(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    parts_.heartbeat.beat();
    TriggerEvent event = parts_.source.wait(kTurn);
    if (const auto* edge = std::get_if<TriggerEdge>(&event)) {
      retries_.reset();
      if (edge->button == 0) {
        const bool is_press = edge->action == TriggerAction::kPressed;
        (void)parts_.rig.push(
            EdgeSeen{{is_press ? EdgeDirection::kPress : EdgeDirection::kRelease, edge->timestamp}},
            stop);
      }
    } else if (auto* fault = std::get_if<DeviceFault>(&event)) {
      if (fault_policy(fault->kind).action != FaultAction::kContinue) {
        return std::move(*fault);
      }
    } else if (std::holds_alternative<EndOfTriggers>(event)) {
      return std::nullopt;
    }
  }
  return std::nullopt;
}

void TriggerReader::wait_to_retry(const std::stop_token& stop, nanoseconds delay) {
  std::mutex mutex;
  std::condition_variable_any never;
  std::unique_lock lock(mutex);
  const nanoseconds begin = parts_.clock.now();
  while (!stop.stop_requested()) {
    parts_.heartbeat.beat();
    const nanoseconds left = delay - (parts_.clock.now() - begin);
    if (left.count() <= 0) {
      return;
    }
    never.wait_for(lock, stop, std::min<nanoseconds>(left, kTurn), [] { return false; });
  }
}

}  // namespace trigmesh
