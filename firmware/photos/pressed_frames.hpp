#pragma once

#include <filesystem>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/photo_set.hpp"

namespace trigmesh {

/// What a press does in a recording of button and camera.
enum class PressMeaning {
  kHold,    ///< frames are taken while the button is down
  kToggle,  ///< a press begins, the next one ends
};

/// The frames that the rig would have taken of a recording with events.csv (see
/// drivers/trigger/scripted; the button goes to ground): those from the first press to its end, or
/// to the last frame. All of them when there is no events.csv. They read from `photos`, which
/// outlives them. kInsufficientData: no press, or no frame after it; kCorruptData, kLimitExceeded,
/// kIo.
[[nodiscard]] Result<PhotoSet> frames_while_pressed(const PhotoSet& photos,
                                                    const std::filesystem::path& recording,
                                                    PressMeaning meaning);

}  // namespace trigmesh
