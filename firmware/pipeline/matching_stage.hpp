#pragma once

#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/camera_groups.hpp"
#include "firmware/pipeline/extraction_stage.hpp"
#include "firmware/pipeline/sequence_matching.hpp"
#include "firmware/pipeline/stage_context.hpp"
#include "sfm/mapping/image_store.hpp"
#include "sfm/matching/pair_selection.hpp"

namespace trigmesh {

/// How images are compared.
struct MatchingStageOptions {
  PairMode pair_mode = PairMode::kAuto;
  bool ordered = false;  ///< neighbours in the list are neighbours in time
  std::uint64_t seed = 0;
};

/// Compares the images that are worth it and verifies what matches by epipolar geometry. Pairs in
/// ascending order, those without any candidates left out. The finished stage is a checkpoint.
/// Errors: kCancelled; kIo, kNoSpace of the checkpoints.
[[nodiscard]] Result<std::vector<PairRecord>> match_photos(
    const std::vector<ExtractedImage>& images,
    const CameraGroups& cameras,
    const MatchingStageOptions& options,
    const StageContext& context);

/// The same for the keyframes of a walk, in their order: see SequenceMatcher. Each keyframe is a
/// checkpoint, which does not depend on those after it.
[[nodiscard]] Result<std::vector<PairRecord>> match_walk(const std::vector<ExtractedImage>& images,
                                                         const CameraGroups& cameras,
                                                         const SequenceMatchingOptions& options,
                                                         const StageContext& context);

/// Bytes for a checkpoint and back. Decoding anything else gives kCorruptData.
[[nodiscard]] std::vector<std::uint8_t> encode_pairs(const std::vector<PairRecord>& pairs);
[[nodiscard]] Result<std::vector<PairRecord>> decode_pairs(std::span<const std::uint8_t> bytes);

}  // namespace trigmesh
