#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <string_view>

#include "firmware/daemon/model_maker.hpp"
#include "firmware/session/journal_records.hpp"

namespace trigmesh {

/// What the operator should do now. A closed list; what comes first is more urgent.
enum class Advice : std::uint8_t {
  kNone,          ///< go on like that
  kGoBack,        ///< lost: back to the last good view
  kMoreLight,     ///< too dark
  kSlower,        ///< too fast, nothing connects the frames
  kHoldSteady,    ///< blurred
  kStepSideways,  ///< no parallax yet: do not only turn
  kEnough,        ///< came around, everything connects
};

/// "none", "go back", ...: stable, for events and journals.
[[nodiscard]] std::string_view to_string(Advice advice);

/// One sentence for people.
[[nodiscard]] std::string_view sentence_of(Advice advice);

/// Says from the verdicts on the latest frames and from the map of the walk what the operator
/// should do. A pure function of what it is told. Thread-compatible.
class Guide {
 public:
  /// A walk begins.
  void begin();

  /// Frames were judged.
  void see(std::span<const FrameJudged> frames);

  /// The map followed, or did not.
  void follow(const MapFollowed& map);

  [[nodiscard]] Advice advice() const;

 private:
  [[nodiscard]] bool is_dark() const;
  [[nodiscard]] std::size_t count_latest(bool (*is_meant)(const FrameJudged&)) const;

  std::deque<FrameJudged> latest_;
  MapFollowed map_;
  std::size_t lost_in_row_ = 0;
  bool came_around_ = false;
};

}  // namespace trigmesh
