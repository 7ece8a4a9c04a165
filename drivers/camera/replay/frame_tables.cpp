#include "drivers/camera/replay/frame_tables.hpp"

#include <charconv>
#include <cstdint>
#include <set>
#include <system_error>
#include <utility>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

constexpr std::size_t kMaxLineBytes = 4096;
constexpr std::string_view kTimestampHeader = "name,timestamp_ns";

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

/// Takes lines off a text one by one and counts them.
class LineCursor {
 public:
  explicit LineCursor(std::string_view text) : rest_(text) {
    constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
    if (rest_.substr(0, kByteOrderMark.size()) == kByteOrderMark) {
      rest_.remove_prefix(kByteOrderMark.size());
    }
  }

  /// False at the end of the text.
  [[nodiscard]] bool advance() {
    if (rest_.empty()) {
      return false;
    }
    const std::size_t end = rest_.find('\n');
    line_ = rest_.substr(0, end);
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    if (!line_.empty() && line_.back() == '\r') {
      line_.remove_suffix(1);
    }
    ++number_;
    return true;
  }

  [[nodiscard]] std::string_view line() const { return line_; }

  [[nodiscard]] std::size_t number() const { return number_; }

 private:
  std::string_view rest_;
  std::string_view line_;
  std::size_t number_ = 0;
};

bool has_control_character(std::string_view text) {
  for (const char c : text) {
    const auto value = static_cast<unsigned char>(c);
    if (value < 0x20U || value == 0x7FU) {
      return true;
    }
  }
  return false;
}

Result<TimestampRow> parse_timestamp_row(std::string_view line,
                                         std::string_view file,
                                         std::size_t number) {
  const std::size_t comma = line.find(',');
  if (comma == std::string_view::npos || line.find(',', comma + 1) != std::string_view::npos) {
    return fail(ErrorCode::kCorruptData,
                "{}:{}: expected two columns, name and timestamp_ns",
                file,
                number);
  }
  const std::string_view name = line.substr(0, comma);
  const std::string_view value = line.substr(comma + 1);
  if (!is_safe_frame_name(name)) {
    return fail(ErrorCode::kCorruptData,
                "{}:{}: the name must be a relative path below images/ without control characters",
                file,
                number);
  }
  std::int64_t nanoseconds = 0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), nanoseconds);
  if (error != std::errc{} || end != value.data() + value.size() || nanoseconds < 0) {
    return fail(ErrorCode::kCorruptData,
                "{}:{}: the timestamp must be a whole number of nanoseconds, 0 or more",
                file,
                number);
  }
  return TimestampRow{std::string(name), std::chrono::nanoseconds(nanoseconds)};
}

tl::unexpected<Error> too_many_rows(std::string_view file, std::size_t max_rows) {
  return fail(
      ErrorCode::kLimitExceeded, "{}: more than {} frames, the declared limit", file, max_rows);
}

}  // namespace

Result<std::vector<TimestampRow>> parse_timestamps(std::string_view text,
                                                   std::string_view file,
                                                   std::size_t max_rows) {
  LineCursor cursor(text);
  if (!cursor.advance() || cursor.line() != kTimestampHeader) {
    return fail(
        ErrorCode::kCorruptData, "{}:1: the first line must be '{}'", file, kTimestampHeader);
  }
  std::vector<TimestampRow> rows;
  std::set<std::string, std::less<>> seen;
  while (cursor.advance()) {
    if (cursor.line().empty()) {
      continue;
    }
    if (cursor.line().size() > kMaxLineBytes) {
      return fail(ErrorCode::kCorruptData,
                  "{}:{}: longer than {} bytes",
                  file,
                  cursor.number(),
                  kMaxLineBytes);
    }
    if (rows.size() == max_rows) {
      return too_many_rows(file, max_rows);
    }
    TM_ASSIGN_OR_RETURN(TimestampRow row,
                        parse_timestamp_row(cursor.line(), file, cursor.number()));
    if (!seen.insert(row.name).second) {
      return fail(
          ErrorCode::kCorruptData, "{}:{}: '{}' is listed twice", file, cursor.number(), row.name);
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

Result<std::vector<std::string>> parse_frame_list(std::string_view text,
                                                  std::string_view file,
                                                  std::size_t max_rows) {
  LineCursor cursor(text);
  std::vector<std::string> paths;
  std::set<std::string, std::less<>> seen;
  while (cursor.advance()) {
    const std::string_view line = cursor.line();
    if (line.empty() || line.front() == '#') {
      continue;
    }
    if (line.size() > kMaxLineBytes || has_control_character(line)) {
      return fail(ErrorCode::kCorruptData,
                  "{}:{}: not a path (control characters, or longer than {} bytes); a list file "
                  "has one picture a line",
                  file,
                  cursor.number(),
                  kMaxLineBytes);
    }
    if (paths.size() == max_rows) {
      return too_many_rows(file, max_rows);
    }
    if (!seen.insert(std::string(line)).second) {
      return fail(
          ErrorCode::kCorruptData, "{}:{}: '{}' is listed twice", file, cursor.number(), line);
    }
    paths.emplace_back(line);
  }
  return paths;
}

bool is_safe_frame_name(std::string_view name) {
  if (name.empty() || name.front() == '/' || has_control_character(name)) {
    return false;
  }
  while (!name.empty()) {
    const std::size_t slash = name.find('/');
    if (name.substr(0, slash) == "..") {
      return false;
    }
    name.remove_prefix(slash == std::string_view::npos ? name.size() : slash + 1);
  }
  return true;
}

bool natural_less(std::string_view a, std::string_view b) {
  std::size_t i = 0;
  std::size_t j = 0;
  const auto number_at = [](std::string_view text, std::size_t& position) {
    const std::size_t begin = position;
    while (position < text.size() && is_digit(text[position])) {
      ++position;
    }
    std::string_view digits = text.substr(begin, position - begin);
    while (digits.size() > 1 && digits.front() == '0') {
      digits.remove_prefix(1);
    }
    return digits;
  };
  while (i < a.size() && j < b.size()) {
    if (is_digit(a[i]) && is_digit(b[j])) {
      const std::string_view x = number_at(a, i);
      const std::string_view y = number_at(b, j);
      if (x.size() != y.size()) {
        return x.size() < y.size();
      }
      if (x != y) {
        return x < y;
      }
    } else {
      if (a[i] != b[j]) {
        return static_cast<unsigned char>(a[i]) < static_cast<unsigned char>(b[j]);
      }
      ++i;
      ++j;
    }
  }
  if (i < a.size() || j < b.size()) {
    return j < b.size();
  }
  return a < b;
}

}  // namespace trigmesh
