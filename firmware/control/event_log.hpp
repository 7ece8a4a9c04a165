#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <vector>

namespace trigmesh {

/// Something that watchers are told.
struct ControlEvent {
  std::uint64_t number = 0;  ///< 1, 2, 3, ..
  std::string kind;          ///< "phase", "progress": letters only
  std::string data;          ///< one line, JSON
};

/// The last events, for watchers that come and go; nobody waits for a slow one, which misses the
/// oldest (their numbers tell). Thread-safe.
class EventLog {
 public:
  /// `capacity` > 0.
  explicit EventLog(std::size_t capacity) : capacity_(capacity) {}

  void publish(std::string kind, std::string data);

  /// The events after number `after` that are still there; waits until there is one, the time-out
  /// has passed or the log was closed. An `after` that was never given (a watcher from before a
  /// restart) counts as 0.
  [[nodiscard]] std::vector<ControlEvent> wait_after(std::uint64_t after,
                                                     std::chrono::milliseconds timeout);

  /// Ends all waiting, now and later.
  void close();

  [[nodiscard]] bool is_closed() const;

  /// Of the newest event; 0: none.
  [[nodiscard]] std::uint64_t last_number() const;

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t capacity_;
  std::deque<ControlEvent> events_;
  std::uint64_t last_number_ = 0;
  bool closed_ = false;
};

}  // namespace trigmesh
