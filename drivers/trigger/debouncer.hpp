#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "drivers/trigger/trigger_source.hpp"

namespace trigmesh {

/// Makes one edge of the many that a contact gives while it closes or opens. A change counts when
/// the line has been at rest for the settling time; it carries the time of its first edge, so that
/// waiting costs no accuracy. What returns to where it was is noise and gives nothing. A press that
/// is shorter than the settling time is noise too. Pure: time comes with the calls.
/// Thread-compatible.
class Debouncer {
 public:
  /// `settle` >= 0; `initial` is what the line is at.
  Debouncer(std::chrono::nanoseconds settle, TriggerAction initial)
      : settle_(settle), stable_(initial), last_(initial) {}

  /// An edge of the line: it is at `action` since `time`. Returns the change that settled before
  /// it. A time before that of the edge before counts as the same.
  [[nodiscard]] std::optional<TriggerEdge> feed(std::chrono::nanoseconds time,
                                                TriggerAction action);

  /// The change that has settled by `now`, if one has.
  [[nodiscard]] std::optional<TriggerEdge> settle(std::chrono::nanoseconds now);

  /// When settle() has something to look at; nothing while the line is at rest.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> deadline() const;

  /// What the last edge said.
  [[nodiscard]] TriggerAction last() const { return last_; }

  /// Edges that were fed and gave no change.
  [[nodiscard]] std::uint64_t suppressed_count() const { return suppressed_; }

 private:
  std::chrono::nanoseconds settle_;
  TriggerAction stable_;
  TriggerAction last_;
  std::chrono::nanoseconds first_time_{0};  ///< of the edges since the line was at rest
  std::chrono::nanoseconds last_time_{0};
  std::uint64_t edge_count_ = 0;  ///< since the line was at rest
  std::uint64_t suppressed_ = 0;
};

}  // namespace trigmesh
