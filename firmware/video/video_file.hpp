#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/video/video_stream.hpp"

namespace trigmesh {

/// Whether a path names a file of bytes that are not text: a video, perhaps, and no list of
/// photographs. Looks at the beginning only; false for what cannot be read.
[[nodiscard]] bool is_binary_file(const std::filesystem::path& path);

/// Asks the program ffprobe what is in a file. Containers that may name other files or addresses
/// (playlists, image sequences) are refused, nothing but the file is opened. kUnsupported: not a
/// video, no moving pictures, or ffprobe is not installed (says how to get it); kCorruptData: a
/// video, but damaged beyond use; kLimitExceeded; kCancelled; kIo.
[[nodiscard]] Result<VideoStream> probe_video(const std::filesystem::path& file,
                                              const std::stop_token& stop);

/// How frames are taken out of a video.
struct ExtractionOptions {
  std::size_t max_frames = 100'000;  ///< more is kLimitExceeded; > 0
  int num_threads = 1;               ///< of the decoder; > 0. The frames do not depend on it.
};

/// What extract_frames came to.
struct ExtractedFrames {
  std::size_t frames = 0;               ///< in timestamps.csv; at least 1
  std::vector<std::string> warnings{};  ///< what was wrong with the video, one sentence each
};

/// Has the program ffmpeg decode all frames of a stream, upright, and writes them into `folder`,
/// which is there, as a recording: images/000001.jpg and so on (JPEG at nearly the highest quality)
/// and timestamps.csv with the time at which each is shown since the first, whatever the rate is or
/// however it varies. Frames that do not follow the one before in time are left out. What can be
/// decoded of a damaged or cut video is kept, and a warning says how much. `on_frame` is told how
/// many are written. What lies in `folder` after an error is of no use. The same video and ffmpeg
/// give the same bytes. kCorruptData: no frame can be decoded; kUnsupported: ffmpeg is not
/// installed or lacks the decoder; kNoSpace: there is not or will not be enough; kLimitExceeded;
/// kCancelled; kIo.
[[nodiscard]] Result<ExtractedFrames> extract_frames(
    const std::filesystem::path& file,
    const VideoStream& stream,
    const std::filesystem::path& folder,
    const ExtractionOptions& options,
    const std::function<void(std::size_t)>& on_frame,
    const std::stop_token& stop);

}  // namespace trigmesh
