#include "drivers/trigger/debouncer.hpp"

#include <algorithm>
#include <utility>

namespace trigmesh {

std::optional<TriggerEdge> Debouncer::feed(std::chrono::nanoseconds time, TriggerAction action) {
  std::optional<TriggerEdge> settled = settle(time);
  if (edge_count_ == 0) {
    first_time_ = time;
    last_time_ = time;
  }
  last_time_ = std::max(last_time_, time);
  last_ = action;
  ++edge_count_;
  return settled;
}

std::optional<TriggerEdge> Debouncer::settle(std::chrono::nanoseconds now) {
  if (edge_count_ == 0 || now < last_time_ + settle_) {
    return std::nullopt;
  }
  const std::uint64_t count = std::exchange(edge_count_, 0);
  if (last_ == stable_) {
    suppressed_ += count;
    return std::nullopt;
  }
  suppressed_ += count - 1;
  stable_ = last_;
  return TriggerEdge{.timestamp = first_time_, .button = 0, .action = stable_};
}

std::optional<std::chrono::nanoseconds> Debouncer::deadline() const {
  return edge_count_ == 0 ? std::nullopt : std::optional(last_time_ + settle_);
}

}  // namespace trigmesh
