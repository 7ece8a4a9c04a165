#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/photo_set.hpp"
#include "firmware/pipeline/report_sections.hpp"
#include "firmware/pipeline/stage_context.hpp"
#include "sfm/keyframes/keyframe_selector.hpp"

namespace trigmesh {

/// Which pictures of the input become photographs of the model.
enum class FrameUse {
  kAuto,       ///< the keyframes of a video, all of anything else
  kAll,        ///< every picture
  kKeyframes,  ///< the keyframes, however far in time the pictures are from each other
  kWalk,       ///< every picture: they are the keyframes of a walk, in its order
};

/// "auto", "all", "keyframes", "walk".
[[nodiscard]] std::string_view to_string(FrameUse use);
[[nodiscard]] std::optional<FrameUse> frame_use_from_string(std::string_view name);

/// Whether keyframes are to be chosen. kAuto: when the pictures have times, half of them 0.1 s or
/// less after the one before. kInvalidArgument: kKeyframes for pictures without times.
[[nodiscard]] Result<bool> wants_keyframes(const PhotoSet& photos, FrameUse use);

/// The keyframes of a video, with what became of each of its frames; it reads from `photos`, which
/// outlives it. Looks at all frames in order of time. Frames that cannot be decoded or have another
/// size than the first stay in the set, without a verdict: a later stage tells why it refuses them.
/// Precondition: `photos` has times. kInvalidArgument: options; kInsufficientData: no frame is
/// kept; kCancelled.
[[nodiscard]] Result<PhotoSet> choose_keyframes(const PhotoSet& photos,
                                                const KeyframeOptions& options,
                                                const StageContext& context);

}  // namespace trigmesh
