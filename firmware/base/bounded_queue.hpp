#pragma once

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <stop_token>
#include <utility>
#include <vector>

#include "firmware/base/check.hpp"

namespace trigmesh {

/// What a full queue does with one more item.
enum class OverflowPolicy : std::uint8_t {
  kBlock,       ///< whoever pushes waits
  kDropOldest,  ///< the oldest item goes, and is counted
};

/// What became of a push.
enum class PushOutcome : std::uint8_t { kPushed, kPushedDroppingOldest, kStopped };

/// What went through a queue since it was made.
struct QueueCounters {
  std::uint64_t pushed = 0;
  std::uint64_t dropped = 0;
  std::size_t most_waiting = 0;
};

/// Items from some threads to others, in their order, at most `capacity` at a time. Takes its
/// memory when it is made. Thread-safe.
template <typename T>
class BoundedQueue {
 public:
  /// Precondition: capacity > 0.
  BoundedQueue(std::size_t capacity, OverflowPolicy policy) : slots_(capacity), policy_(policy) {
    TM_CHECK(capacity > 0);
  }

  BoundedQueue(const BoundedQueue&) = delete;
  BoundedQueue& operator=(const BoundedQueue&) = delete;
  BoundedQueue(BoundedQueue&&) = delete;
  BoundedQueue& operator=(BoundedQueue&&) = delete;
  ~BoundedQueue() = default;

  /// kBlock: waits for room, or until `stop`: then the item is not in the queue. What is dropped is
  /// destroyed in this thread.
  PushOutcome push(T item, const std::stop_token& stop = {}) {
    std::optional<T> dropped;  // destroyed when the queue is free again
    {
      std::unique_lock lock(mutex_);
      if (policy_ == OverflowPolicy::kBlock) {
        if (!has_room_.wait(lock, stop, [this] { return count_ < slots_.size(); })) {
          return PushOutcome::kStopped;
        }
      } else if (count_ == slots_.size()) {
        dropped = take_first();
        ++counters_.dropped;
      }
      slots_[(first_ + count_) % slots_.size()] = std::move(item);
      ++count_;
      ++counters_.pushed;
      counters_.most_waiting = std::max(counters_.most_waiting, count_);
    }
    has_item_.notify_one();
    return dropped ? PushOutcome::kPushedDroppingOldest : PushOutcome::kPushed;
  }

  /// The oldest item; nothing when none came within `timeout` or until `stop`.
  [[nodiscard]] std::optional<T> pop(const std::stop_token& stop,
                                     std::chrono::nanoseconds timeout) {
    std::optional<T> item;
    {
      std::unique_lock lock(mutex_);
      if (!has_item_.wait_for(lock, stop, timeout, [this] { return count_ > 0; })) {
        return std::nullopt;
      }
      item = take_first();
    }
    has_room_.notify_one();
    return item;
  }

  /// The oldest item, if there is one now.
  [[nodiscard]] std::optional<T> try_pop() {
    std::optional<T> item;
    {
      const std::lock_guard lock(mutex_);
      if (count_ == 0) {
        return std::nullopt;
      }
      item = take_first();
    }
    has_room_.notify_one();
    return item;
  }

  [[nodiscard]] std::size_t size() const {
    const std::lock_guard lock(mutex_);
    return count_;
  }

  [[nodiscard]] std::size_t capacity() const { return slots_.size(); }

  [[nodiscard]] QueueCounters counters() const {
    const std::lock_guard lock(mutex_);
    return counters_;
  }

 private:
  /// Precondition: mutex_ is held, count_ > 0.
  [[nodiscard]] std::optional<T> take_first() {
    std::optional<T> item = std::exchange(slots_[first_], std::nullopt);
    first_ = (first_ + 1) % slots_.size();
    --count_;
    return item;
  }

  mutable std::mutex mutex_;
  std::condition_variable_any has_item_;
  std::condition_variable_any has_room_;
  std::vector<std::optional<T>> slots_;  ///< a ring; guarded by mutex_
  OverflowPolicy policy_;
  std::size_t first_ = 0;   ///< guarded by mutex_
  std::size_t count_ = 0;   ///< guarded by mutex_
  QueueCounters counters_;  ///< guarded by mutex_
};

}  // namespace trigmesh
