#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "drivers/camera/frame.hpp"
#include "drivers/camera/libcamera/frame_stamp.hpp"
#include "drivers/camera/libcamera/mapped_planes.hpp"
#include "drivers/camera/libcamera/told_controls.hpp"
#include "drivers/device/wake_event.hpp"

namespace trigmesh {

/// What libcamera says of a buffer that it filled.
struct FilledSlot {
  std::size_t slot = 0;
  std::size_t bytes_used = 0;
  std::uint32_t sequence = 0;
  bool is_damaged = false;  ///< the pipeline itself says so
  ToldTimes times;
  std::optional<std::chrono::nanoseconds> exposure;
  std::optional<double> gain;
  ToldControls controls;
  std::uint64_t control_round = 0;  ///< of the last change of controls that reached this frame
};

/// Who keeps the pictures that nobody takes while all buffers but a few are filled.
enum class FullExchange : std::uint8_t {
  kKeep,   ///< all stay; the camera loses new frames, as with any driver
  kRenew,  ///< the oldest goes back to the camera, which so never stands still
};

/// The buffers of a stream between libcamera, us and the frames, and their mapped memory. Owns
/// neither camera nor requests, so it may outlive them: memory that a frame has stays until the
/// frame is released.
///
/// A buffer that comes back is handed to the camera by on_filled(), on libcamera's thread, because
/// that takes memory from the heap; by give_back() itself only when the camera has fewer than two.
///
/// Threads: on_filled and on_gone on libcamera's thread; give_back on any; the rest on the thread
/// of the source.
class FrameExchange final : public FramePool {
 public:
  /// Hands a slot to the camera; false when it refuses. Called with this exchange locked.
  using Queue = std::function<bool(std::size_t slot)>;

  /// All slots are ours at first.
  explicit FrameExchange(std::vector<MappedPlanes> memory);

  /// Whether the system had a descriptor for the wake-up. Everything else needs this to be true.
  [[nodiscard]] bool valid() const { return ready_.valid(); }

  /// Hands all slots to the camera. False when it takes fewer than two: nothing can stream.
  [[nodiscard]] bool begin(Queue queue);

  void on_filled(const FilledSlot& filled);

  /// Forgets what is filled and was not taken, so that the next frame is a new one.
  void discard_filled();

  /// The camera gave a buffer back without a picture (a cancelled request).
  void on_cancelled(std::size_t slot);

  /// The camera was unplugged.
  void on_gone();

  /// The next filled buffer, in the order of capture; nothing when there is none.
  [[nodiscard]] std::optional<FilledSlot> take();

  /// The memory of a slot, all planes in one piece.
  [[nodiscard]] std::span<const std::uint8_t> memory(std::size_t slot) const {
    return memory_[slot].bytes();
  }

  void give_back(std::size_t slot) noexcept override;

  /// Nothing goes to the camera any more, and memory that no frame has is unmapped. Before the
  /// camera is stopped.
  void end();

  void set_when_full(FullExchange policy);

  [[nodiscard]] bool is_gone() const;
  [[nodiscard]] std::size_t queued_count() const;

  [[nodiscard]] std::size_t count() const { return memory_.size(); }

  /// What the last filled buffer told, and how many were filled so far.
  struct Progress {
    std::uint64_t filled_count = 0;
    std::uint64_t control_round = 0;
    ToldControls controls;
  };

  [[nodiscard]] Progress progress() const;

  /// Set when a buffer was filled or the camera went: clear it, look, then wait for it.
  [[nodiscard]] WakeEvent& ready() { return ready_; }

 private:
  enum class Owner : std::uint8_t { kUs, kCamera, kFilled, kFrame };

  void queue_what_is_ours();
  void renew();
  [[nodiscard]] std::size_t count_of(Owner owner) const;

  mutable std::mutex mutex_;
  std::vector<MappedPlanes> memory_;
  std::vector<Owner> owners_;       ///< guarded by mutex_
  std::vector<FilledSlot> filled_;  ///< guarded by mutex_; in the order of capture, room for all
  Queue queue_;                     ///< guarded by mutex_; empty when not streaming
  FullExchange when_full_ = FullExchange::kKeep;  ///< guarded by mutex_
  bool is_gone_ = false;                          ///< guarded by mutex_
  Progress progress_;                             ///< guarded by mutex_
  WakeEvent ready_;
};

}  // namespace trigmesh
