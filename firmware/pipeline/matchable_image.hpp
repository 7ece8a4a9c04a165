#pragma once

#include "firmware/base/result.hpp"
#include "firmware/pipeline/camera_groups.hpp"
#include "firmware/pipeline/image_features.hpp"
#include "sfm/matching/pair_matching.hpp"

namespace trigmesh {

/// A photograph ready to be compared with others: undistorted by what is known of its camera.
/// Borrows the descriptors: the features outlive it and stay unchanged (moving them is allowed).
[[nodiscard]] Result<MatchableImage> matchable_image(const ImageFeatures& image,
                                                     const CameraGroup& group);

}  // namespace trigmesh
