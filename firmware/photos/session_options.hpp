#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/reconstruction.hpp"
#include "firmware/settings/settings.hpp"
#include "sfm/camera/camera.hpp"

namespace trigmesh {

/// What the settings of the rig say about models. 0 threads: one a core.
[[nodiscard]] ReconstructionOptions model_options(const ReconstructionSettings& settings,
                                                  const ScaleSettings& scale,
                                                  const std::string& software_version);

/// What is known of the camera before the first picture: the camera of the session's profile
/// (TOML), or none. kCorruptData.
[[nodiscard]] Result<std::vector<Camera>> cameras_of_profile(const std::string& profile,
                                                             const std::string& session_id);

/// The options with which the rig makes the model of this session: the settings and the profile
/// that it was captured with. kNotFound: no session of the rig; kInvalidArgument, kCorruptData,
/// kIo.
[[nodiscard]] Result<ReconstructionOptions> options_of_session(const std::filesystem::path& session,
                                                               const std::string& software_version);

}  // namespace trigmesh
