#pragma once

#include <filesystem>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/report_sections.hpp"

namespace trigmesh {

/// What the journal of a session tells of the frames of its video, in order of time: the verdict on
/// each that was looked at, and of the kept ones how they were mapped while the capture went on.
/// Frames that were discarded by the operator are left out, as if they had never been. Empty: no
/// video, or no selector. kNotFound, kIo, kLimitExceeded.
[[nodiscard]] Result<std::vector<VideoFrameSection>> read_session_frames(
    const std::filesystem::path& session);

}  // namespace trigmesh
