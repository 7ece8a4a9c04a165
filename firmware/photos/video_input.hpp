#pragma once

#include <filesystem>
#include <stop_token>

#include "firmware/base/result.hpp"
#include "firmware/photos/photo_input.hpp"
#include "firmware/pipeline/photo_set.hpp"
#include "firmware/pipeline/progress.hpp"

namespace trigmesh {

/// Whether `input` has to go through open_video first: a file that is neither text nor a single
/// picture.
[[nodiscard]] bool is_video_input(const std::filesystem::path& input);

/// The frames of a video file, taken out into `output`/frames unless they are there already from
/// the very same file. They are put together in `output`/.frames.part and appear whole or not at
/// all. `num_threads` > 0. Errors of probe_video and extract_frames; kInvalidArgument:
/// `output`/frames is there and was not made by this function.
[[nodiscard]] Result<PhotoSet> open_video(const std::filesystem::path& input,
                                          const std::filesystem::path& output,
                                          MaskUse masks,
                                          int num_threads,
                                          ProgressListener& listener,
                                          const std::stop_token& stop);

}  // namespace trigmesh
