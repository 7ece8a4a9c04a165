#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/control/event_log.hpp"

namespace trigmesh {

/// Takes server-sent events out of a stream of bytes that comes in pieces of any size. Reads the
/// part of the format that ControlServer writes: the fields id, event and data, one data line an
/// event, comments. Thread-compatible.
class EventStreamReader {
 public:
  /// Longest event, bytes.
  static constexpr std::size_t kMaxEventBytes = std::size_t{64} << 10U;

  /// The events that are complete now. kCorruptData: one is longer than kMaxEventBytes.
  [[nodiscard]] Result<std::vector<ControlEvent>> add(std::string_view bytes);

 private:
  void take_line(std::string_view line, std::vector<ControlEvent>& events);

  std::string rest_;  ///< a line without its end
  ControlEvent event_;
};

}  // namespace trigmesh
