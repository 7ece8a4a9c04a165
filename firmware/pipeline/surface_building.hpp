#pragma once

#include <span>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/model_place.hpp"
#include "firmware/pipeline/photo_set.hpp"
#include "firmware/pipeline/reconstruction.hpp"
#include "firmware/pipeline/stage_context.hpp"
#include "firmware/pipeline/stopwatch.hpp"

namespace trigmesh {

/// What the stages after mapping work on. All of it outlives the call.
struct BuildInput {
  const PhotoSet& photos;
  std::span<const Scene> components;  ///< the first is the main model, which gets the surface
  ModelPlace& place;
  const ReconstructionOptions& options;
};

/// Depth maps, dense cloud, mesh and textured mesh of the main model, as far as the options say;
/// each result is added to the model at its place as soon as it exists, with a renewed report.
/// Finished pieces are found in the work folder again. Errors: kCancelled (finished pieces are
/// kept), kInsufficientData (no two views that see the same), kLimitExceeded (the memory limit is
/// below what the smallest settings need), kIo, kNoSpace.
[[nodiscard]] Result<> build_surface(const BuildInput& input,
                                     const StageContext& context,
                                     Stopwatch& stopwatch,
                                     ReconstructionReport& report);

}  // namespace trigmesh
