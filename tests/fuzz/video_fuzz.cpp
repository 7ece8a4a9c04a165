#include <cstddef>
#include <cstdint>
#include <string_view>

#include "firmware/base/check.hpp"
#include "firmware/video/frame_times.hpp"
#include "firmware/video/video_stream.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

/// What the programs ffprobe and ffmpeg say, of a video from outside. An accepted stream has a
/// size; times are the same however their text was cut.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr std::size_t kMaxFrames = 50;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (const auto stream = trigmesh::parse_video_stream(text, "fuzz")) {
    TM_CHECK(stream->index >= 0 && stream->width_px > 0 && stream->height_px > 0);
    TM_CHECK(!stream->duration_s || *stream->duration_s > 0.0);
  }
  trigmesh::FrameTimeReader whole(kMaxFrames);
  const bool accepted = whole.add(text).has_value();
  TM_CHECK(whole.times().size() <= kMaxFrames);
  trigmesh::FrameTimeReader halves(kMaxFrames);
  const bool accepted_halves =
      halves.add(text.substr(0, size / 2)).has_value() && halves.add(text.substr(size / 2));
  TM_CHECK(accepted == accepted_halves);
  TM_CHECK(!accepted || whole.times() == halves.times());
  return 0;
}
