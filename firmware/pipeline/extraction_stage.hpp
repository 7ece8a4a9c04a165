#pragma once

#include <optional>
#include <string>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/image_features.hpp"
#include "firmware/pipeline/stage_context.hpp"
#include "sfm/features/features.hpp"

namespace trigmesh {

struct PhotoSet;

/// One photograph after extraction: its features, or why there are none.
struct ExtractedImage {
  std::optional<ImageFeatures> features;
  Error error;  ///< meaningful only without features
};

/// Reads every photograph and finds its keypoints. A photograph that cannot be read is an entry
/// with an error, not the end. Each finished photograph is a checkpoint. Errors: kCancelled, and
/// kIo or kNoSpace of the checkpoint folder.
[[nodiscard]] Result<std::vector<ExtractedImage>> extract_photos(const PhotoSet& photos,
                                                                 FeatureKind kind,
                                                                 const FeatureOptions& options,
                                                                 const StageContext& context);

}  // namespace trigmesh
