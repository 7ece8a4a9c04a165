#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include "drivers/trigger/trigger_source.hpp"
#include "firmware/base/result.hpp"

namespace trigmesh {

/// What a falling voltage means.
enum class ButtonWiring {
  kActiveLow,   ///< to ground, with a pull-up: falling is pressed
  kActiveHigh,  ///< rising is pressed
};

/// Largest number of a line in events.csv.
inline constexpr std::uint32_t kMostEventLine = 1023;

/// Reads events.csv: a header that begins with `timestamp_ns,line,edge`, then one row an edge:
/// whole nanoseconds, 0 or more, not going back; the line, which becomes the button; `falling` or
/// `rising`. Further columns are not looked at; lines end with LF or CRLF; empty lines are skipped;
/// there is no quoting. The edges of a line alternate. `file` is for messages. kCorruptData with
/// file, line and reason; kLimitExceeded: more than `max_rows`.
[[nodiscard]] Result<std::vector<TriggerEdge>> parse_events(std::string_view text,
                                                            std::string_view file,
                                                            ButtonWiring wiring,
                                                            std::size_t max_rows);

}  // namespace trigmesh
