#include "firmware/video/frame_times.hpp"

#include <charconv>
#include <cmath>
#include <optional>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

// Lines of this format have about 60 characters.
constexpr std::size_t kMaxLineBytes = 4096;
constexpr std::string_view kTimeBase = "#tb 0:";
// A year in either direction: whatever is beyond comes from a damaged file.
constexpr double kMaxSeconds = 3.2e7;
constexpr double kNanosecondsPerSecond = 1e9;

std::string_view without_blanks(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string_view::npos) {
    return {};
  }
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::optional<std::int64_t> whole_number(std::string_view text) {
  text = without_blanks(text);
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(value)
                                                                  : std::nullopt;
}

/// What stands between the `index`-th comma and the one before it, counted from 0.
std::string_view field(std::string_view line, int index) {
  for (; index > 0; --index) {
    const std::size_t comma = line.find(',');
    line = comma == std::string_view::npos ? std::string_view() : line.substr(comma + 1);
  }
  return line.substr(0, line.find(','));
}

tl::unexpected<Error> bad_line(std::string_view line) {
  return fail(ErrorCode::kCorruptData, "cannot understand what ffmpeg says of a frame: '{}'", line);
}

}  // namespace

Result<> FrameTimeReader::add(std::string_view piece) {
  while (!piece.empty()) {
    const std::size_t end = piece.find('\n');
    unfinished_line_.append(piece.substr(0, end));
    if (unfinished_line_.size() > kMaxLineBytes) {
      return bad_line(unfinished_line_.substr(0, 60) + "...");
    }
    if (end == std::string_view::npos) {
      return {};
    }
    TM_RETURN_IF_ERROR(read_line(without_blanks(unfinished_line_)));
    unfinished_line_.clear();
    piece.remove_prefix(end + 1);
  }
  return {};
}

Result<> FrameTimeReader::read_line(std::string_view line) {
  if (line.starts_with(kTimeBase)) {
    return read_time_base(line.substr(kTimeBase.size()));
  }
  return line.empty() || line.front() == '#' ? Result<>() : read_frame(line);
}

Result<> FrameTimeReader::read_time_base(std::string_view text) {
  const std::size_t slash = text.find('/');
  if (slash == std::string_view::npos) {
    return bad_line(text);
  }
  const std::int64_t above = whole_number(text.substr(0, slash)).value_or(0);
  const std::int64_t below = whole_number(text.substr(slash + 1)).value_or(0);
  if (above <= 0 || below <= 0) {
    return bad_line(text);
  }
  tick_numerator_ = above;
  tick_denominator_ = below;
  return {};
}

Result<> FrameTimeReader::read_frame(std::string_view line) {
  const auto tick = whole_number(field(line, 2));
  if (!tick || tick_numerator_ == 0) {
    return bad_line(line);
  }
  if (times_.size() == max_frames_) {
    return fail(ErrorCode::kLimitExceeded, "the video has more than {} frames", max_frames_);
  }
  if (times_.empty()) {
    first_tick_ = *tick;
  }
  // Exact to a nanosecond within a day: double has 53 bits.
  const double seconds = (static_cast<double>(*tick) - static_cast<double>(first_tick_)) *
                         static_cast<double>(tick_numerator_) /
                         static_cast<double>(tick_denominator_);
  if (seconds > kMaxSeconds || seconds < -kMaxSeconds) {
    return bad_line(line);
  }
  times_.emplace_back(std::llround(seconds * kNanosecondsPerSecond));
  return {};
}

}  // namespace trigmesh
