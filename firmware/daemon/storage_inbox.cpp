#include "firmware/daemon/storage_inbox.hpp"

#include <algorithm>
#include <utility>

namespace trigmesh {
namespace {

bool is_stream_frame(const StorageOrder& order) {
  return std::holds_alternative<StreamFrameOrder>(order);
}

bool is_still(const StorageOrder& order) {
  return std::holds_alternative<StillFrameOrder>(order);
}

}  // namespace

void StorageInbox::push(StorageOrder order) {
  std::optional<StorageOrder> dropped;  // its buffer goes back when the inbox is free again
  {
    std::unique_lock lock(mutex_);
    if (is_stream_frame(order)) {
      if (stream_frames_ == max_stream_frames_) {
        dropped = take_oldest_stream_frame();
        ++counters_.dropped_frames;
      }
      ++stream_frames_;
      counters_.most_frames = std::max(counters_.most_frames, stream_frames_);
    } else if (is_still(order)) {
      ++stills_;
    } else {
      has_room_.wait(lock, [this] {
        return is_closed_ || orders_.size() - stream_frames_ - stills_ < max_others_;
      });
    }
    if (is_closed_) {
      dropped = std::move(order);
      return;
    }
    orders_.push_back(std::move(order));
  }
  has_order_.notify_one();
}

StorageOrder StorageInbox::take_oldest_stream_frame() {
  const auto oldest = std::find_if(orders_.begin(), orders_.end(), is_stream_frame);
  StorageOrder order = std::move(*oldest);
  orders_.erase(oldest);
  --stream_frames_;
  return order;
}

std::optional<StorageOrder> StorageInbox::pop(std::chrono::nanoseconds timeout) {
  std::optional<StorageOrder> order;
  {
    std::unique_lock lock(mutex_);
    has_order_.wait_for(lock, timeout, [this] { return is_closed_ || !orders_.empty(); });
    if (orders_.empty()) {
      return std::nullopt;
    }
    order = std::move(orders_.front());
    orders_.pop_front();
    stream_frames_ -= is_stream_frame(*order) ? 1U : 0U;
    stills_ -= is_still(*order) ? 1U : 0U;
  }
  has_room_.notify_all();
  return order;
}

void StorageInbox::close() {
  {
    const std::lock_guard lock(mutex_);
    is_closed_ = true;
  }
  has_order_.notify_all();
  has_room_.notify_all();
}

bool StorageInbox::is_finished() const {
  const std::lock_guard lock(mutex_);
  return is_closed_ && orders_.empty();
}

InboxCounters StorageInbox::counters() const {
  const std::lock_guard lock(mutex_);
  return counters_;
}

}  // namespace trigmesh
