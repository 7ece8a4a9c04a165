#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "firmware/daemon/capture_types.hpp"
#include "firmware/daemon/frame_copies.hpp"
#include "firmware/session/press_binding.hpp"

namespace trigmesh {

struct StillShelfOptions {
  /// Copies of the last frames that are held, because a press is known only after its edge (it is
  /// free of bounce then) and because threads are late. 0: none is held unless a press waits.
  std::size_t history = 8;
  /// How long a press waits for its frame. > 0.
  std::chrono::nanoseconds wait = std::chrono::seconds(2);
};

/// The answer to take().
struct StillResult {
  SessionSerial serial{};
  StillTicket ticket{};
  /// A copy; nothing: no frame came in time.
  std::optional<TimedFrame> frame;
};

/// Holds copies of frames until it is known what the presses mean. A press gets its frame by
/// PressBinder as soon as its edge is known (expect), and keeps it until it turns out to be a still
/// (take) or something else (forget): so a few copies are enough, however long a press lasts.
/// Takes no memory from the heap while nobody presses. Thread-compatible.
class StillShelf {
 public:
  /// `copies` outlives it.
  StillShelf(const StillShelfOptions& options, FrameCopies& copies);

  /// A press began.
  void expect(std::chrono::nanoseconds press);

  /// The press of this time is a still. Also without expect().
  void take(SessionSerial serial, StillTicket ticket, std::chrono::nanoseconds press);

  /// Presses that were expected up to and with `press` are no stills.
  void forget(std::chrono::nanoseconds press);

  /// A frame came; it is copied if it may be wanted. False: it was, and no buffer was free.
  [[nodiscard]] bool offer(const Frame& frame, const FrameTimes& times, std::uint64_t sequence);

  /// Gives up presses that waited too long.
  void on_time(std::chrono::nanoseconds now);

  /// When on_time has something to say.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> deadline() const {
    return binder_.deadline();
  }

  /// The answers since the last call. A press that is not decided yet holds up no later one.
  [[nodiscard]] std::vector<StillResult> take_results();

 private:
  /// A press between its edge and its answer.
  struct Pending {
    std::chrono::nanoseconds time{};
    bool is_bound = false;  ///< the binder has answered
    bool is_forgotten = false;
    std::optional<std::pair<SessionSerial, StillTicket>> wanted;
    std::optional<TimedFrame> frame;
  };

  void settle(const std::vector<BoundPress>& answers);
  void feed(const TimedFrame& held);
  /// The frame of this sequence, and those before it go: later presses need later frames.
  [[nodiscard]] std::optional<TimedFrame> lift(std::uint64_t sequence);

  StillShelfOptions options_;
  FrameCopies& copies_;
  PressBinder binder_;
  std::vector<TimedFrame> held_;  ///< oldest first; at most history, more while a press waits
  std::uint64_t next_fed_ = 0;    ///< frames before this sequence were shown to the binder
  std::deque<Pending> pending_;
};

}  // namespace trigmesh
