#pragma once

#include <string>

#include "drivers/camera/replay/recording.hpp"
#include "firmware/base/result.hpp"
#include "firmware/pipeline/photo_set.hpp"

namespace trigmesh {

/// Whether masks/NAME.png beside the photographs are used.
enum class MaskUse { kUse, kIgnore };

/// The photographs of a folder, list file or recording, as the pipeline wants them.
[[nodiscard]] Result<PhotoSet> open_photos(const std::string& input,
                                           Subfolders subfolders,
                                           MaskUse masks);

}  // namespace trigmesh
