#include "drivers/camera/slot_pool.hpp"

#include <utility>

namespace trigmesh {

SlotPool::SlotPool(std::size_t slot_count, std::shared_ptr<const void> keep_alive)
    : keep_alive_(std::move(keep_alive)), buffers_(slot_count) {
  free_.reserve(slot_count);
  for (std::size_t i = slot_count; i > 0; --i) {
    free_.push_back(i - 1);
  }
}

std::optional<std::size_t> SlotPool::take() {
  const std::lock_guard lock(mutex_);
  if (free_.empty()) {
    return std::nullopt;
  }
  const std::size_t slot = free_.back();
  free_.pop_back();
  return slot;
}

void SlotPool::give_back(std::size_t slot) noexcept {
  {
    const std::lock_guard lock(mutex_);
    free_.push_back(slot);  // never grows: room for all slots was reserved
  }
  returned_.set();
}

std::size_t SlotPool::out_count() const {
  const std::lock_guard lock(mutex_);
  return buffers_.size() - free_.size();
}

}  // namespace trigmesh
