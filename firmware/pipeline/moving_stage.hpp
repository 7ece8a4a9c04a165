#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/dense_stage.hpp"
#include "firmware/pipeline/model_writer.hpp"
#include "firmware/pipeline/photo_set.hpp"
#include "firmware/pipeline/report_sections.hpp"
#include "firmware/pipeline/stage_context.hpp"
#include "sfm/dense/dense_view.hpp"

namespace trigmesh {

/// An encoded mask (PNG of the photograph's size, white = leave out), or none.
using EncodedMask = std::optional<std::vector<std::uint8_t>>;

/// Finds what moved while the photographs were taken (sfm/moving): one mask a view, of the size of
/// its photograph; none where nothing moved. The masks are kept in the work folder under the key of
/// the depth maps. `input.plan.moving_side_px` is not 0. kCancelled, kIo, kNoSpace, what the images
/// return.
[[nodiscard]] Result<std::vector<EncodedMask>> find_moving(const DenseInput& input,
                                                           const DepthMaps& depth,
                                                           const StageContext& context);

/// The photographs with these masks laid over their own; `masks` belong to `views`. Reads from
/// `photos`, which outlives it.
[[nodiscard]] PhotoSet with_masks(const PhotoSet& photos,
                                  std::span<const DenseView> views,
                                  const std::vector<EncodedMask>& masks);

/// The files masks/NAME.png of a model.
[[nodiscard]] std::vector<NamedFile> mask_files(std::span<const DenseView> views,
                                                const std::vector<EncodedMask>& masks);

/// What there is to tell of the masks. kCorruptData: a mask cannot be decoded.
[[nodiscard]] Result<MovingSection> sum_up_masks(std::span<const DenseView> views,
                                                 const std::vector<EncodedMask>& masks);

}  // namespace trigmesh
