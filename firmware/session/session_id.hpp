#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

namespace trigmesh {

/// "20261125T145054Z-3fa9c1": the time of day in UTC to the second, and six hexadecimal digits of
/// `entropy`. Ids sort by time. Times outside 1970 to 9999 become the nearest of them.
[[nodiscard]] std::string make_session_id(std::chrono::nanoseconds wall, std::uint64_t entropy);

/// Whether the text has that form, with a time that exists. Also says that it is safe as a name of
/// a folder.
[[nodiscard]] bool is_session_id(std::string_view text);

/// An id that sorts behind `newest` (empty: none), whatever the clock says: a board without a
/// battery begins at an old time, and a clock may be set back. The honest time stands in the
/// session's manifest.
[[nodiscard]] std::string next_session_id(std::string_view newest,
                                          std::chrono::nanoseconds wall,
                                          std::uint64_t entropy);

}  // namespace trigmesh
