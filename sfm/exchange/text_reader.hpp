#pragma once

#include <charconv>
#include <concepts>
#include <cstddef>
#include <string>
#include <string_view>

#include "firmware/base/result.hpp"

namespace trigmesh {

/// Reads lines of blank-separated fields from a text in memory. The first thing that is wrong stops
/// it: from then on every field is zero or empty, no line follows, and `status()` is kCorruptData
/// with the line number. So a record is read field by field and checked once:
///
///     while (reader.next_record()) {
///       const auto id = reader.integer<std::uint32_t>("an id");
///       const double x = reader.real("x");
///       if (!reader.ok()) break;
///       ...
///     }
///     if (Result<> status = reader.status(); !status) return ...
class TextReader {
 public:
  /// `text` must outlive the reader; `source` names it in messages ("cameras.txt").
  TextReader(std::string_view text, std::string_view source) : text_(text), source_(source) {}

  /// Goes to the next line that is no comment (#); false at the end of the text or after a failure.
  /// LF and CRLF.
  bool next_line();
  /// The same, and skips blank lines.
  bool next_record();
  /// True when only blanks are left in the line.
  [[nodiscard]] bool at_line_end();

  /// The next field; failure when the line has no more. `what` names it in the message.
  std::string_view word(std::string_view what);
  /// A finite number.
  double real(std::string_view what);

  /// Continues at this byte of the line (at most its length).
  void go_to(std::size_t position) { position_ = position; }

  /// Exactly what follows one blank after the last field.
  std::string_view rest();

  template <std::integral T>
  T integer(std::string_view what) {
    const std::string_view token = word(what);
    T value{};
    const auto [end, error] = std::from_chars(token.data(), token.data() + token.size(), value);
    if (ok() && (error != std::errc{} || end != token.data() + token.size())) {
      reject_field(what, token);
      return T{};
    }
    return value;
  }

  /// Records the first failure; later ones are dropped.
  void reject(std::string_view reason, ErrorCode code = ErrorCode::kCorruptData);

  [[nodiscard]] bool ok() const { return error_.message.empty(); }

  [[nodiscard]] Result<> status() const;

  [[nodiscard]] std::size_t line_number() const { return line_number_; }

  [[nodiscard]] std::string_view line() const { return line_; }

 private:
  void reject_field(std::string_view what, std::string_view token);

  std::string_view text_;
  std::string source_;
  std::string_view line_;
  std::size_t position_ = 0;  ///< of the next byte in line_
  std::size_t line_number_ = 0;
  Error error_;
};

}  // namespace trigmesh
