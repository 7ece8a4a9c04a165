#include "firmware/daemon/still_shelf.hpp"

#include <algorithm>
#include <utility>

namespace trigmesh {
namespace {

using std::chrono::nanoseconds;

/// While a press waits for its frame, at least so many are held: the binder waits for frames that
/// come out of order.
constexpr std::size_t kHeldWhileWaiting = 4;

PressBindingOptions binding_options(const StillShelfOptions& options) {
  PressBindingOptions binding;
  binding.wait = options.wait;
  binding.history = std::max(options.history, kHeldWhileWaiting);
  return binding;
}

}  // namespace

StillShelf::StillShelf(const StillShelfOptions& options, FrameCopies& copies)
    : options_(options), copies_(copies), binder_(binding_options(options)) {
  held_.reserve(std::max(options.history, kHeldWhileWaiting) + 1);
}

void StillShelf::expect(nanoseconds press) {
  for (const TimedFrame& held : held_) {
    feed(held);
  }
  pending_.push_back({});
  pending_.back().time = press;
  settle(binder_.on_press(press));
}

void StillShelf::take(SessionSerial serial, StillTicket ticket, nanoseconds press) {
  const auto is_it = [press](const Pending& pending) {
    return pending.time == press && !pending.wanted && !pending.is_forgotten;
  };
  if (std::none_of(pending_.begin(), pending_.end(), is_it)) {
    expect(press);
  }
  const auto found = std::find_if(pending_.begin(), pending_.end(), is_it);
  found->wanted = std::pair(serial, ticket);
}

void StillShelf::forget(nanoseconds press) {
  for (Pending& pending : pending_) {
    if (!pending.wanted && pending.time <= press) {
      pending.is_forgotten = true;
      pending.frame.reset();
    }
  }
}

bool StillShelf::offer(const Frame& frame, const FrameTimes& times, std::uint64_t sequence) {
  const bool is_awaited = binder_.waiting_count() > 0;
  if (options_.history == 0 && !is_awaited) {
    held_.clear();
    return true;
  }
  const std::size_t limit =
      std::max(options_.history, is_awaited ? kHeldWhileWaiting : std::size_t{0});
  while (held_.size() >= limit) {
    held_.erase(held_.begin());
  }
  Frame copy = copies_.copy(frame, sequence);
  if (copy.empty()) {
    return false;
  }
  held_.push_back({std::move(copy), times, sequence});
  if (is_awaited) {
    feed(held_.back());
  }
  return true;
}

void StillShelf::feed(const TimedFrame& held) {
  if (held.sequence < next_fed_) {
    return;
  }
  next_fed_ = held.sequence + 1;
  const Exposure exposure{held.sequence, held.times.begin, held.times.end};
  settle(binder_.on_frame(exposure));
}

void StillShelf::on_time(nanoseconds now) {
  settle(binder_.on_time(now));
}

std::optional<TimedFrame> StillShelf::lift(std::uint64_t sequence) {
  const auto found = std::find_if(held_.begin(), held_.end(), [sequence](const TimedFrame& held) {
    return held.sequence == sequence;
  });
  if (found == held_.end()) {
    return std::nullopt;
  }
  std::optional<TimedFrame> frame = std::move(*found);
  found->frame.release();  // stays as an empty place, so that a walk over the frames may go on
  return frame;
}

void StillShelf::settle(const std::vector<BoundPress>& answers) {
  for (const BoundPress& answer : answers) {  // in the order of the presses
    const auto pending = std::find_if(
        pending_.begin(), pending_.end(), [](const Pending& one) { return !one.is_bound; });
    pending->is_bound = true;
    if (answer.sequence && !pending->is_forgotten) {
      pending->frame = lift(*answer.sequence);
    }
  }
}

std::vector<StillResult> StillShelf::take_results() {
  std::vector<StillResult> results;
  for (auto pending = pending_.begin(); pending != pending_.end();) {
    if (!pending->is_bound || (!pending->wanted && !pending->is_forgotten)) {
      ++pending;
      continue;
    }
    if (pending->wanted) {
      results.push_back(
          {pending->wanted->first, pending->wanted->second, std::move(pending->frame)});
    }
    pending = pending_.erase(pending);
  }
  return results;
}

}  // namespace trigmesh
