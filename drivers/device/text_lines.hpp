#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace trigmesh {

/// Takes the lines off a text one by one and counts them: LF or CRLF, a byte order mark is stepped
/// over. For the small tables of a recording, which are ours and have no quoting.
class LineCursor {
 public:
  /// `text` outlives the cursor.
  explicit LineCursor(std::string_view text);

  /// False at the end of the text.
  [[nodiscard]] bool advance();

  /// Without its end.
  [[nodiscard]] std::string_view line() const { return line_; }

  /// From 1.
  [[nodiscard]] std::size_t number() const { return number_; }

 private:
  std::string_view rest_;
  std::string_view line_;
  std::size_t number_ = 0;
};

/// The text as a whole number, 0 or more; nothing when it is anything else, or too large.
[[nodiscard]] std::optional<std::int64_t> whole_number(std::string_view text);

}  // namespace trigmesh
