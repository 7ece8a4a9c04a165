#include "firmware/video/video_stream.hpp"

#include <charconv>
#include <cmath>
#include <cstdint>
#include <utility>

#include <nlohmann/json.hpp>

#include "firmware/base/check.hpp"

namespace trigmesh {
namespace {

using nlohmann::json;

// What the decoder of photographs takes (sfm/exchange).
constexpr std::int64_t kMaxPixels = 200'000'000;
// Ten years: whatever is above is a damaged header.
constexpr double kMaxDurationS = 3.2e8;
constexpr double kMaxFramesPerSecond = 1e6;

/// A member of an object that may lack it; null then.
const json& member(const json& object, const char* name) {
  static const json kNothing;
  const auto found = object.is_object() ? object.find(name) : object.end();
  return found != object.end() && object.is_object() ? *found : kNothing;
}

std::string text_of(const json& value) {
  return value.is_string() ? value.get<std::string>() : std::string();
}

/// A positive number in the whole of `text`; ffprobe writes many numbers as text.
std::optional<double> positive_number(std::string_view text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value) ||
      value <= 0.0) {
    return std::nullopt;
  }
  return value;
}

/// "30000/1001" as a number; nothing for "0/0".
std::optional<double> ratio(const std::string& text) {
  const std::size_t slash = text.find('/');
  if (slash == std::string::npos) {
    return std::nullopt;
  }
  const auto above = positive_number(std::string_view(text).substr(0, slash));
  const auto below = positive_number(std::string_view(text).substr(slash + 1));
  return above && below ? std::optional(*above / *below) : std::nullopt;
}

std::optional<double> duration_of(const json& stream, const json& format) {
  const auto of_stream = positive_number(text_of(member(stream, "duration")));
  const auto duration =
      of_stream ? of_stream : positive_number(text_of(member(format, "duration")));
  return duration && *duration <= kMaxDurationS ? duration : std::nullopt;
}

std::optional<std::size_t> frame_count_of(const json& stream, std::optional<double> duration_s) {
  if (const auto told = positive_number(text_of(member(stream, "nb_frames")));
      told && *told <= kMaxDurationS * kMaxFramesPerSecond) {
    return static_cast<std::size_t>(*told);
  }
  const auto rate = ratio(text_of(member(stream, "avg_frame_rate")));
  if (!rate || *rate > kMaxFramesPerSecond || !duration_s) {
    return std::nullopt;
  }
  return static_cast<std::size_t>(std::lround(*rate * *duration_s));
}

/// Whether the frames are shown with width and height exchanged.
bool is_turned(const json& stream) {
  for (const json& data : member(stream, "side_data_list")) {
    const json& rotation = member(data, "rotation");
    if (rotation.is_number()) {
      const double degrees = std::abs(std::remainder(rotation.get<double>(), 180.0));
      return degrees > 45.0;
    }
  }
  return false;
}

bool is_moving_picture(const json& stream) {
  const json& cover = member(member(stream, "disposition"), "attached_pic");
  return text_of(member(stream, "codec_type")) == "video" && cover != 1;
}

std::optional<std::int64_t> whole_number(const json& value) {
  return value.is_number_integer() ? std::optional(value.get<std::int64_t>()) : std::nullopt;
}

Result<VideoStream> stream_from(const json& stream, const json& format, std::string_view file) {
  const auto index = whole_number(member(stream, "index"));
  const auto width = whole_number(member(stream, "width"));
  const auto height = whole_number(member(stream, "height"));
  if (!index || *index < 0 || *index > 10'000 || !width || !height || *width <= 0 || *height <= 0) {
    return fail(ErrorCode::kCorruptData,
                "cannot read video {}: its header is damaged, the pictures have no size",
                file);
  }
  if (*width > kMaxPixels / *height) {
    return fail(ErrorCode::kLimitExceeded,
                "cannot read video {}: its pictures have {}x{} pixels, more than {} million",
                file,
                *width,
                *height,
                kMaxPixels / 1'000'000);
  }
  VideoStream result;
  result.index = static_cast<int>(*index);
  result.codec = text_of(member(stream, "codec_name"));
  result.width_px = static_cast<int>(*width);
  result.height_px = static_cast<int>(*height);
  if (is_turned(stream)) {
    std::swap(result.width_px, result.height_px);
  }
  result.duration_s = duration_of(stream, format);
  result.frame_count = frame_count_of(stream, result.duration_s);
  return result;
}

}  // namespace

Result<VideoStream> parse_video_stream(std::string_view text, std::string_view file) {
  const json answer = json::parse(text, nullptr, false);
  const json& streams = member(answer, "streams");
  if (!streams.is_array()) {
    return fail(ErrorCode::kCorruptData, "cannot read what ffprobe says of {}", file);
  }
  for (const json& stream : streams) {
    if (is_moving_picture(stream)) {
      return stream_from(stream, member(answer, "format"), file);
    }
  }
  return fail(ErrorCode::kUnsupported,
              "{} has no moving pictures, only {}",
              file,
              streams.empty() ? "an empty container" : "sound or a cover picture");
}

}  // namespace trigmesh
