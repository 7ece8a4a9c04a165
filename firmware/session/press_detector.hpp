#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/session/journal_records.hpp"

namespace trigmesh {

/// What the operator did with the button.
enum class PressKind {
  kDown,    ///< the button went down: the first that is known of every press
  kUp,      ///< the button came up again
  kShort,   ///< one press, shorter than long_press, and no second one soon after it
  kLong,    ///< one press of long_press or longer; told while the button is still down
  kDouble,  ///< two short presses, the second soon after the first
};

struct Press {
  PressKind kind = PressKind::kShort;
  std::chrono::nanoseconds time{};  ///< of its (first) press edge; kUp: of the release edge

  bool operator==(const Press&) const = default;
};

struct PressOptions {
  /// A press of this length is long. > 0.
  std::chrono::nanoseconds long_press = std::chrono::milliseconds(1000);
  /// Longest time from the release of a short press to the next press edge that makes the two a
  /// double press; 0: there is no double press, and short ones are told at once. >= 0.
  std::chrono::nanoseconds double_press = std::chrono::milliseconds(300);

  [[nodiscard]] Result<> validate() const;
};

/// Turns edges into presses by their kernel timestamps alone; when it is called does not matter.
/// Every press edge ends up in exactly one kShort, kLong or kDouble (which takes two); with kDown
/// and kUp as they come. Edges that cannot be (two presses in a row: an edge was lost) end the
/// press before. Thread-compatible. Used as
///
///     for (const Press& press : detector.on_edge(edge)) { .. }
///     // at detector.deadline(), when no edge came before it:
///     for (const Press& press : detector.on_time(now)) { .. }
class PressDetector {
 public:
  /// Precondition: `options` are valid.
  explicit PressDetector(const PressOptions& options);

  /// Times must not go back; one that does counts as the time before. Includes what on_time says.
  [[nodiscard]] std::vector<Press> on_edge(const EdgeRecord& edge);

  /// What is certain at `now`, on the clock of the edges, given that no edge came before it.
  [[nodiscard]] std::vector<Press> on_time(std::chrono::nanoseconds now);

  /// When on_time will have something to say; nothing: never without an edge.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> deadline() const;

  /// Releases without a press.
  [[nodiscard]] std::uint64_t stray_edges() const { return stray_edges_; }

 private:
  void end_press(std::chrono::nanoseconds release, std::vector<Press>& presses);

  PressOptions options_;
  std::chrono::nanoseconds last_time_{};
  std::optional<std::chrono::nanoseconds> down_since_;
  bool long_told_ = false;  ///< of the press that is down
  /// A short press that may become a double one.
  std::optional<std::chrono::nanoseconds> waiting_press_;
  std::chrono::nanoseconds waiting_since_{};  ///< its release
  std::uint64_t stray_edges_ = 0;
};

}  // namespace trigmesh
