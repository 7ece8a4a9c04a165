#include "drivers/camera/replay/frame_tables.hpp"

#include <cstdint>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include "drivers/device/text_lines.hpp"
#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

constexpr std::size_t kMaxLineBytes = 4096;

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

bool has_control_character(std::string_view text) {
  for (const char c : text) {
    const auto value = static_cast<unsigned char>(c);
    if (value < 0x20U || value == 0x7FU) {
      return true;
    }
  }
  return false;
}

/// Unit of the second column.
enum class TimeColumn { kNanoseconds, kSeconds };

/// The header's first two columns decide; further ones are for others.
std::optional<TimeColumn> time_column(std::string_view header) {
  const std::size_t first = header.find(',');
  const std::size_t second = header.find(',', first + 1);
  if (first == std::string_view::npos || header.substr(0, first) != "name") {
    return std::nullopt;
  }
  const std::string_view unit =
      header.substr(first + 1, second == std::string_view::npos ? second : second - first - 1);
  if (unit == "timestamp_ns") {
    return TimeColumn::kNanoseconds;
  }
  return unit == "timestamp_s" ? std::optional(TimeColumn::kSeconds) : std::nullopt;
}

/// Seconds with up to nine decimals, exactly: no floating point.
std::optional<std::int64_t> nanoseconds_from_seconds(std::string_view text) {
  constexpr std::size_t kDecimals = 9;
  constexpr std::int64_t kPerSecond = 1'000'000'000;
  const std::size_t point = text.find('.');
  std::string decimals(point == std::string_view::npos ? std::string_view()
                                                       : text.substr(point + 1));
  if (decimals.size() > kDecimals || (point != std::string_view::npos && decimals.empty())) {
    return std::nullopt;
  }
  decimals.resize(kDecimals, '0');
  const auto seconds = whole_number(text.substr(0, point));
  const auto rest = whole_number(decimals);
  if (!seconds || !rest || *seconds >= std::numeric_limits<std::int64_t>::max() / kPerSecond) {
    return std::nullopt;
  }
  return *seconds * kPerSecond + *rest;
}

Result<TimestampRow> parse_timestamp_row(std::string_view line,
                                         TimeColumn column,
                                         std::string_view file,
                                         std::size_t number) {
  const std::size_t comma = line.find(',');
  if (comma == std::string_view::npos) {
    return fail(
        ErrorCode::kCorruptData, "{}:{}: expected a name, a comma and a timestamp", file, number);
  }
  const std::string_view name = line.substr(0, comma);
  std::string_view value = line.substr(comma + 1);
  value = value.substr(0, value.find(','));
  if (!is_safe_frame_name(name)) {
    return fail(ErrorCode::kCorruptData,
                "{}:{}: the name must be a relative path below images/ without control characters",
                file,
                number);
  }
  const auto nanoseconds =
      column == TimeColumn::kSeconds ? nanoseconds_from_seconds(value) : whole_number(value);
  if (!nanoseconds) {
    return fail(ErrorCode::kCorruptData,
                "{}:{}: the timestamp must be {}, 0 or more",
                file,
                number,
                column == TimeColumn::kSeconds ? "seconds with at most nine decimals"
                                               : "a whole number of nanoseconds");
  }
  return TimestampRow{std::string(name), std::chrono::nanoseconds(*nanoseconds)};
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
  const auto column = cursor.advance() ? time_column(cursor.line()) : std::nullopt;
  if (!column) {
    return fail(ErrorCode::kCorruptData,
                "{}:1: the first line must begin with 'name,timestamp_ns' or 'name,timestamp_s'",
                file);
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
                        parse_timestamp_row(cursor.line(), *column, file, cursor.number()));
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
