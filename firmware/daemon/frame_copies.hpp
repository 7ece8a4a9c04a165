#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <utility>

#include "drivers/camera/frame.hpp"
#include "drivers/camera/slot_pool.hpp"

namespace trigmesh {

/// Copies of frames in a fixed number of buffers, so that the camera gets its own back at once and
/// memory is bounded, however slow the storage is. A buffer is used again: nothing is allocated
/// once each has held the largest frame. Thread-safe.
class FrameCopies {
 public:
  explicit FrameCopies(std::size_t count) : pool_(std::make_shared<SlotPool>(count, nullptr)) {}

  /// An empty frame when all buffers are in use. The copy has no name, and counts as `sequence`.
  [[nodiscard]] Frame copy(const Frame& frame, std::uint64_t sequence) {
    const std::optional<std::size_t> slot = pool_->take();
    if (!slot) {
      return {};
    }
    std::vector<std::uint8_t>& bytes = pool_->bytes(*slot);
    bytes.assign(frame.bytes().begin(), frame.bytes().end());
    FrameInfo info = frame.info();
    info.name = {};
    info.sequence = sequence;
    return {info, bytes, pool_, *slot};
  }

  /// In use now.
  [[nodiscard]] std::size_t out_count() const { return pool_->out_count(); }

  [[nodiscard]] std::size_t capacity() const { return pool_->slot_count(); }

 private:
  std::shared_ptr<SlotPool> pool_;  // shared with the copies
};

}  // namespace trigmesh
