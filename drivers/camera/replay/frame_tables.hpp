#pragma once

#include <chrono>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/base/result.hpp"

namespace trigmesh {

/// One row of timestamps.csv.
struct TimestampRow {
  std::string name;
  std::chrono::nanoseconds timestamp{};

  bool operator==(const TimestampRow&) const = default;
};

/// Reads timestamps.csv: a header that begins with `name,timestamp_ns` or `name,timestamp_s`, then
/// one row a frame: a name without comma, and whole nanoseconds or seconds with up to nine
/// decimals, 0 or more. Further columns are not looked at. Lines end with LF or CRLF; empty lines
/// are skipped; there is no quoting. `file` is for messages. kCorruptData with file, line and
/// reason: other header, not a number, a name that is unsafe (see is_safe_frame_name) or given
/// twice; kLimitExceeded: more than `max_rows`.
[[nodiscard]] Result<std::vector<TimestampRow>> parse_timestamps(std::string_view text,
                                                                 std::string_view file,
                                                                 std::size_t max_rows);

/// Reads a list of picture files: one path a line, relative to the list file or absolute; empty
/// lines and lines that start with '#' are skipped. Returns the paths as written, '\' not touched.
/// Errors as parse_timestamps.
[[nodiscard]] Result<std::vector<std::string>> parse_frame_list(std::string_view text,
                                                                std::string_view file,
                                                                std::size_t max_rows);

/// A relative path that stays below its folder and has no control character: "a.jpg", "left/a.jpg";
/// not "", "/a", "../a".
[[nodiscard]] bool is_safe_frame_name(std::string_view name);

/// Orders names as people do: runs of digits compare as numbers (img2 < img10); equal otherwise: by
/// bytes (img01 < img1).
[[nodiscard]] bool natural_less(std::string_view a, std::string_view b);

}  // namespace trigmesh
