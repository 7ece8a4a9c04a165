#pragma once

#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/photo_set.hpp"
#include "firmware/pipeline/report_sections.hpp"
#include "firmware/pipeline/stage_context.hpp"
#include "sfm/calibration/marker_dictionary.hpp"
#include "sfm/scale/known_lengths.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// What is known of markers in the scene, for a model in metres.
struct ScaleOptions {
  MarkerDictionary dictionary{};  ///< that the markers are of
  KnownLengths known{};           ///< none: models stay up to scale, and no picture is looked at
  UpSource up = UpSource::kNone;

  /// kInvalidArgument: see KnownLengths; up without a marker of which a length is known.
  [[nodiscard]] Result<> validate() const;
};

/// Models, and what became of the unit of each.
struct ScaledModels {
  std::vector<Scene> components;
  std::vector<ScaleSection> scale;  ///< per component; empty when no length is known
};

/// Finds markers in the photographs that have a pose, outside of their masks, and brings every
/// model that sees known lengths well enough into metres; with UpSource::kCard its origin and axes
/// become those of the card, z up. A model whose lengths disagree stays as it is; its section says
/// why. Errors: kCancelled, kIo and others of a photograph that can no longer be read.
[[nodiscard]] Result<ScaledModels> find_metric_scale(const PhotoSet& photos,
                                                     std::vector<Scene> components,
                                                     const ScaleOptions& options,
                                                     const StageContext& context);

}  // namespace trigmesh
