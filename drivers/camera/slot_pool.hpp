#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "drivers/camera/frame.hpp"
#include "drivers/device/wake_event.hpp"

namespace trigmesh {

/// Buffers in our own memory, for sources whose bytes come from files or scripts. A buffer keeps
/// its memory for the next frame, so nothing is allocated once each has held the largest one.
/// Thread-safe.
class SlotPool final : public FramePool {
 public:
  /// `keep_alive` lives as long as the last frame: what the names of frames point into.
  SlotPool(std::size_t slot_count, std::shared_ptr<const void> keep_alive);

  /// A buffer that no frame has, with what it last held; nothing when all are out.
  [[nodiscard]] std::optional<std::size_t> take();

  /// The bytes of a slot that was taken and not given back.
  [[nodiscard]] std::vector<std::uint8_t>& bytes(std::size_t slot) { return buffers_[slot]; }

  void give_back(std::size_t slot) noexcept override;

  [[nodiscard]] std::size_t out_count() const;

  [[nodiscard]] std::size_t slot_count() const { return buffers_.size(); }

  /// Set by each buffer that comes back: clear it, look, then wait for it.
  [[nodiscard]] WakeEvent& returned() { return returned_; }

 private:
  std::shared_ptr<const void> keep_alive_;
  std::vector<std::vector<std::uint8_t>> buffers_;
  mutable std::mutex mutex_;
  std::vector<std::size_t> free_;  ///< guarded by mutex_
  WakeEvent returned_;
};

}  // namespace trigmesh
