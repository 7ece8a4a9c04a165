#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/base/result.hpp"

namespace trigmesh {

/// The times of the frames of a video, read from what ffmpeg's output format `framecrc` says of
/// each frame while it works: a line "#tb 0: 1/30" with the length of a tick in seconds, then a
/// line a frame: "0, dts, pts, duration, size, checksum", times in ticks. Lines may come in pieces.
/// https://ffmpeg.org/ffmpeg-formats.html#framecrc
class FrameTimeReader {
 public:
  /// `max_frames`: more is kLimitExceeded.
  explicit FrameTimeReader(std::size_t max_frames) : max_frames_(max_frames) {}

  /// Takes the next piece of text. kCorruptData: a line that is not of this format;
  /// kLimitExceeded. After an error the reader is of no more use.
  [[nodiscard]] Result<> add(std::string_view piece);

  /// When each frame is shown, since the first; in the order of the lines, which need not rise.
  [[nodiscard]] const std::vector<std::chrono::nanoseconds>& times() const { return times_; }

 private:
  [[nodiscard]] Result<> read_line(std::string_view line);
  [[nodiscard]] Result<> read_time_base(std::string_view text);
  [[nodiscard]] Result<> read_frame(std::string_view line);

  std::size_t max_frames_;
  std::string unfinished_line_;
  std::int64_t tick_numerator_ =
      0;  ///< a tick is numerator / denominator seconds; 0: not yet known
  std::int64_t tick_denominator_ = 1;
  std::int64_t first_tick_ = 0;
  std::vector<std::chrono::nanoseconds> times_;
};

}  // namespace trigmesh
