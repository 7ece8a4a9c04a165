#include "drivers/camera/libcamera/frame_exchange.hpp"

#include <algorithm>
#include <utility>

namespace trigmesh {
namespace {

/// With one buffer a camera has none while it writes: it would lose every second frame.
constexpr std::size_t kFewestQueued = 2;

}  // namespace

FrameExchange::FrameExchange(std::vector<MappedPlanes> memory)
    : memory_(std::move(memory)), owners_(memory_.size(), Owner::kUs) {
  filled_.reserve(memory_.size());
}

bool FrameExchange::begin(Queue queue) {
  const std::lock_guard lock(mutex_);
  queue_ = std::move(queue);
  queue_what_is_ours();
  return count_of(Owner::kCamera) >= kFewestQueued;
}

void FrameExchange::queue_what_is_ours() {
  for (std::size_t slot = 0; slot < owners_.size(); ++slot) {
    if (queue_ && owners_[slot] == Owner::kUs) {
      owners_[slot] = Owner::kCamera;
      if (!queue_(slot)) {
        owners_[slot] = Owner::kUs;  // tried again with the next frame
        return;
      }
    }
  }
}

void FrameExchange::renew() {
  if (when_full_ == FullExchange::kRenew && count_of(Owner::kCamera) < kFewestQueued &&
      filled_.size() > 1) {
    owners_[filled_.front().slot] = Owner::kUs;
    filled_.erase(filled_.begin());
  }
}

void FrameExchange::on_filled(const FilledSlot& filled) {
  {
    const std::lock_guard lock(mutex_);
    owners_[filled.slot] = Owner::kFilled;
    filled_.push_back(filled);  // never grows: room for all slots was reserved
    ++progress_.filled_count;
    progress_.control_round = filled.control_round;
    progress_.controls = filled.controls;
    renew();
    queue_what_is_ours();
  }
  ready_.set();
}

void FrameExchange::discard_filled() {
  const std::lock_guard lock(mutex_);
  for (const FilledSlot& filled : filled_) {
    owners_[filled.slot] = Owner::kUs;
  }
  filled_.clear();
  queue_what_is_ours();
}

void FrameExchange::on_cancelled(std::size_t slot) {
  const std::lock_guard lock(mutex_);
  owners_[slot] = Owner::kUs;
}

void FrameExchange::on_gone() {
  {
    const std::lock_guard lock(mutex_);
    is_gone_ = true;
    queue_ = nullptr;
  }
  ready_.set();
}

std::optional<FilledSlot> FrameExchange::take() {
  const std::lock_guard lock(mutex_);
  if (filled_.empty()) {
    return std::nullopt;
  }
  const FilledSlot first = filled_.front();
  filled_.erase(filled_.begin());
  owners_[first.slot] = Owner::kFrame;
  memory_[first.slot].begin_reading();
  return first;
}

void FrameExchange::give_back(std::size_t slot) noexcept {
  const std::lock_guard lock(mutex_);
  memory_[slot].end_reading();
  owners_[slot] = Owner::kUs;
  if (!queue_) {
    memory_[slot].unmap();
  } else if (count_of(Owner::kCamera) < kFewestQueued) {
    queue_what_is_ours();
  }
}

void FrameExchange::end() {
  const std::lock_guard lock(mutex_);
  queue_ = nullptr;
  filled_.clear();
  for (std::size_t slot = 0; slot < owners_.size(); ++slot) {
    if (owners_[slot] != Owner::kFrame) {
      memory_[slot].unmap();  // only our view: the camera has a hold of its own on its buffers
    }
  }
}

void FrameExchange::set_when_full(FullExchange policy) {
  const std::lock_guard lock(mutex_);
  when_full_ = policy;
}

bool FrameExchange::is_gone() const {
  const std::lock_guard lock(mutex_);
  return is_gone_;
}

std::size_t FrameExchange::queued_count() const {
  const std::lock_guard lock(mutex_);
  return count_of(Owner::kCamera);
}

FrameExchange::Progress FrameExchange::progress() const {
  const std::lock_guard lock(mutex_);
  return progress_;
}

std::size_t FrameExchange::count_of(Owner owner) const {
  return static_cast<std::size_t>(std::count(owners_.begin(), owners_.end(), owner));
}

}  // namespace trigmesh
