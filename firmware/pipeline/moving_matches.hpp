#pragma once

#include <optional>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/extraction_stage.hpp"
#include "firmware/pipeline/stage_context.hpp"
#include "sfm/mapping/image_store.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// The pairs without the matches of keypoints that lie on something which moved, as the poses of
/// `scene` show it (its views are the images, in order); nothing when there are hardly any. Few of
/// these matches agree with the poses, by chance, but those that do become points in mid-air.
/// kCancelled; kInvalidArgument: descriptors that do not fit.
[[nodiscard]] Result<std::optional<std::vector<PairRecord>>> drop_moving_matches(
    const Scene& scene,
    const std::vector<ExtractedImage>& images,
    const std::vector<PairRecord>& pairs,
    const StageContext& context);

}  // namespace trigmesh
