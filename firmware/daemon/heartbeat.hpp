#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>

#include "firmware/base/clock.hpp"

namespace trigmesh {

/// A thread's sign of life: beat() once a turn of its loop. Thread-safe.
class Heartbeat {
 public:
  Heartbeat(std::string name, const Clock& clock)
      : name_(std::move(name)), clock_(clock), last_ns_(clock.now().count()) {}

  void beat() { last_ns_ = clock_.now().count(); }

  [[nodiscard]] std::chrono::nanoseconds last() const { return std::chrono::nanoseconds(last_ns_); }

  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  const std::string name_;
  const Clock& clock_;
  std::atomic<std::int64_t> last_ns_;
};

/// The heartbeats of all threads. All are added before the threads begin; then thread-safe.
/// `clock` outlives it.
class Heartbeats {
 public:
  explicit Heartbeats(const Clock& clock) : clock_(clock) {}

  [[nodiscard]] Heartbeat& add(std::string name) {
    return beats_.emplace_back(std::move(name), clock_);
  }

  /// The name of a thread whose last turn is longer ago than `limit`; nothing: all turn.
  [[nodiscard]] std::optional<std::string> hung(std::chrono::nanoseconds limit) const {
    for (const Heartbeat& beat : beats_) {
      if (clock_.now() - beat.last() > limit) {
        return beat.name();
      }
    }
    return std::nullopt;
  }

 private:
  const Clock& clock_;
  std::deque<Heartbeat> beats_;  ///< a deque: references stay
};

/// Whether work that counts up gets on. Single thread.
class ProgressWatch {
 public:
  /// `limit`: how long the count may stand still.
  explicit ProgressWatch(std::chrono::nanoseconds limit) : limit_(limit) {}

  /// Called again and again; false when the count has stood still for too long while `is_running`.
  [[nodiscard]] bool gets_on(bool is_running, std::uint64_t count, std::chrono::nanoseconds now) {
    if (!is_running || !since_ || count != count_) {
      count_ = count;
      since_ = is_running ? std::optional(now) : std::nullopt;
    }
    return !since_ || now - *since_ <= limit_;
  }

 private:
  std::chrono::nanoseconds limit_;
  std::uint64_t count_ = 0;
  std::optional<std::chrono::nanoseconds> since_;
};

}  // namespace trigmesh
