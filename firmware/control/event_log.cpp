#include "firmware/control/event_log.hpp"

#include <utility>

namespace trigmesh {

void EventLog::publish(std::string kind, std::string data) {
  {
    const std::lock_guard lock(mutex_);
    events_.push_back({++last_number_, std::move(kind), std::move(data)});
    if (events_.size() > capacity_) {
      events_.pop_front();
    }
  }
  changed_.notify_all();
}

std::vector<ControlEvent> EventLog::wait_after(std::uint64_t after,
                                               std::chrono::milliseconds timeout) {
  std::unique_lock lock(mutex_);
  const std::uint64_t known = after > last_number_ ? 0 : after;
  changed_.wait_for(lock, timeout, [&] { return closed_ || last_number_ > known; });
  std::vector<ControlEvent> found;
  for (const ControlEvent& event : events_) {
    if (event.number > known) {
      found.push_back(event);
    }
  }
  return found;
}

void EventLog::close() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  changed_.notify_all();
}

bool EventLog::is_closed() const {
  const std::lock_guard lock(mutex_);
  return closed_;
}

std::uint64_t EventLog::last_number() const {
  const std::lock_guard lock(mutex_);
  return last_number_;
}

}  // namespace trigmesh
