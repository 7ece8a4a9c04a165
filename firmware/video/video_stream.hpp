#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "firmware/base/result.hpp"

namespace trigmesh {

/// The moving picture of a video file, as ffprobe describes it.
struct VideoStream {
  int index = 0;  ///< among the streams of the file
  std::string codec;
  int width_px = 0;  ///< as shown: after the rotation that the file asks for
  int height_px = 0;
  std::optional<double> duration_s;        ///< of the stream, else of the file
  std::optional<std::size_t> frame_count;  ///< as the file says, else duration times rate
};

/// Reads the JSON that ffprobe writes about format and streams; takes the first stream of moving
/// pictures, not the cover of a piece of music. `file` is for messages. kCorruptData: not such
/// JSON, a size or count that is no number; kUnsupported: no moving pictures; kLimitExceeded:
/// pictures beyond what our decoder takes.
[[nodiscard]] Result<VideoStream> parse_video_stream(std::string_view json, std::string_view file);

}  // namespace trigmesh
