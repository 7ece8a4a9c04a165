#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "firmware/base/clock.hpp"
#include "firmware/base/file_system.hpp"
#include "firmware/base/result.hpp"
#include "firmware/settings/settings.hpp"

namespace trigmesh {

/// The camera profile that the settings name, as text; empty: they name none. kNotFound,
/// kLimitExceeded, kIo.
[[nodiscard]] Result<std::string> read_profile(const Settings& settings);

/// What cannot be used now though the settings are right, a sentence each: profile, folder of the
/// sessions, camera, button, light. Makes the folder of the sessions if it is missing, as the
/// service does.
[[nodiscard]] std::vector<std::string> unusable_now(const Settings& settings,
                                                    FileSystem& files,
                                                    const Clock& clock);

}  // namespace trigmesh
