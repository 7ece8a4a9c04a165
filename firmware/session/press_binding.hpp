#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "firmware/base/result.hpp"

namespace trigmesh {

/// When a frame was exposed, on the kernel's monotonic clock, which is also that of the edges.
struct Exposure {
  std::uint64_t sequence = 0;  ///< of the sensor: counts every frame, also those that never came
  std::chrono::nanoseconds begin{};
  std::chrono::nanoseconds end{};  ///< >= begin

  bool operator==(const Exposure&) const = default;
};

/// A press and its frame.
struct BoundPress {
  std::chrono::nanoseconds press_time{};
  std::optional<std::uint64_t> sequence;  ///< nothing: no frame came in time

  bool operator==(const BoundPress&) const = default;
};

struct PressBindingOptions {
  /// How long a press waits for its frame, on the clock of the frames. > 0.
  std::chrono::nanoseconds wait = std::chrono::seconds(2);
  /// Frames that are remembered, because a press is known only later than its edge (it might have
  /// become a double one). > 0. Whoever holds the pictures holds as many.
  std::size_t history = 32;
  /// After so many later frames an earlier one that is missing is not waited for. >= 0.
  std::size_t reorder = 2;

  [[nodiscard]] Result<> validate() const;
};

/// Gives each press the first frame whose exposure contains or follows it; each frame to one press
/// only. A frame whose exposure ended before the press is never given. The answer does not depend
/// on the order in which frames and presses arrive, as long as frames are at most `reorder` late.
/// Thread-compatible.
class PressBinder {
 public:
  /// Precondition: `options` are valid.
  explicit PressBinder(const PressBindingOptions& options);

  /// A frame came; its bytes are held by the caller under its sequence. One that came before, or is
  /// older than the whole history, is left out. Precondition: begin <= end.
  [[nodiscard]] std::vector<BoundPress> on_frame(const Exposure& frame);

  /// Presses must come in the order of their times. A time before the last one counts as that.
  [[nodiscard]] std::vector<BoundPress> on_press(std::chrono::nanoseconds time);

  /// Gives up presses that have waited for too long at `now`.
  [[nodiscard]] std::vector<BoundPress> on_time(std::chrono::nanoseconds now);

  /// The camera stopped: no more frames of before will come. Every waiting press gets a frame that
  /// is there, or none.
  [[nodiscard]] std::vector<BoundPress> finish();

  /// When on_time will have something to say.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> deadline() const;

  [[nodiscard]] std::size_t waiting_count() const { return presses_.size(); }

 private:
  enum class Patience { kWaitForMissing, kTakeWhatIsThere };

  /// All presses that can be answered now.
  [[nodiscard]] std::vector<BoundPress> bind_certain();
  /// The oldest press, if there is one and a frame for it.
  [[nodiscard]] std::optional<BoundPress> bind_oldest(Patience patience);
  [[nodiscard]] bool may_come_earlier(std::size_t index) const;

  PressBindingOptions options_;
  std::deque<Exposure> frames_;  ///< sorted by sequence; not given to a press yet
  std::deque<std::chrono::nanoseconds> presses_;
  std::optional<std::uint64_t> newest_sequence_;
  /// Recent sequences that came, whether given or not; sorted.
  std::deque<std::uint64_t> seen_;
};

}  // namespace trigmesh
