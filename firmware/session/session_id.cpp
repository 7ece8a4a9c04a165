#include "firmware/session/session_id.hpp"

#include <algorithm>
#include <charconv>
#include <optional>

#include <fmt/format.h>

#include "firmware/session/layout.hpp"

namespace trigmesh {
namespace {

using std::chrono::seconds;

constexpr std::size_t kTimeLength = 16;  // 20261125T145054Z
constexpr std::size_t kIdLength = kTimeLength + 7;

std::string time_text(seconds since_epoch) {
  using std::chrono::days;
  const std::chrono::sys_seconds time(since_epoch);
  const auto day = std::chrono::floor<days>(time);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss clock(time - day);
  return fmt::format("{:04}{:02}{:02}T{:02}{:02}{:02}Z",
                     static_cast<int>(date.year()),
                     static_cast<unsigned>(date.month()),
                     static_cast<unsigned>(date.day()),
                     clock.hours().count(),
                     clock.minutes().count(),
                     clock.seconds().count());
}

int number_at(std::string_view text, std::size_t at, std::size_t length) {
  int value = -1;
  const char* end = text.data() + at + length;
  const auto [stop, error] = std::from_chars(text.data() + at, end, value);
  return error == std::errc{} && stop == end && text[at] != '-' ? value : -1;
}

/// Of the first characters of an id; nothing when they are no time.
std::optional<seconds> time_of(std::string_view id) {
  namespace ch = std::chrono;
  if (id.size() < kTimeLength || id[8] != 'T' || id[15] != 'Z') {
    return std::nullopt;
  }
  const int hour = number_at(id, 9, 2);
  const int minute = number_at(id, 11, 2);
  const int second = number_at(id, 13, 2);
  const int month = number_at(id, 4, 2);
  const int day = number_at(id, 6, 2);
  const int year = number_at(id, 0, 4);
  if (year < 1970 || month < 0 || day < 0 || hour < 0 || hour > 23 || minute < 0 || minute > 59 ||
      second < 0 || second > 59) {
    return std::nullopt;
  }
  const ch::year_month_day date(
      ch::year(year), ch::month(static_cast<unsigned>(month)), ch::day(static_cast<unsigned>(day)));
  if (!date.ok()) {
    return std::nullopt;
  }
  return ch::sys_days(date).time_since_epoch() + ch::hours(hour) + ch::minutes(minute) +
         seconds(second);
}

seconds clamped(seconds time) {
  const auto last = std::chrono::sys_days(std::chrono::year(9999) / 12 / 31).time_since_epoch();
  return std::clamp(time, seconds(0), std::chrono::duration_cast<seconds>(last));
}

std::string id_of(seconds time, std::uint64_t entropy) {
  constexpr std::uint64_t kSixDigits = 0xFFFFFF;
  return fmt::format("{}-{:06x}", time_text(clamped(time)), entropy & kSixDigits);
}

}  // namespace

std::string frame_file_name(std::uint32_t number) {
  return fmt::format("{:06}.jpg", number);
}

std::optional<std::uint32_t> frame_number_of(std::string_view file_name) {
  std::uint32_t number = 0;
  const auto [end, error] =
      std::from_chars(file_name.data(), file_name.data() + file_name.size(), number);
  if (error != std::errc{} || frame_file_name(number) != file_name) {
    return std::nullopt;
  }
  return number;
}

std::string make_session_id(std::chrono::nanoseconds wall, std::uint64_t entropy) {
  return id_of(std::chrono::floor<seconds>(wall), entropy);
}

bool is_session_id(std::string_view text) {
  const auto is_digit = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
  return text.size() == kIdLength && time_of(text).has_value() && text[kTimeLength] == '-' &&
         std::all_of(text.begin() + kTimeLength + 1, text.end(), is_digit);
}

std::string next_session_id(std::string_view newest,
                            std::chrono::nanoseconds wall,
                            std::uint64_t entropy) {
  std::string id = make_session_id(wall, entropy);
  const std::optional<seconds> newest_time = time_of(newest);
  if (newest_time && id <= newest) {
    id = id_of(*newest_time + seconds(1), entropy);
  }
  return id;
}

}  // namespace trigmesh
