#pragma once

#include <span>
#include <vector>

#include "firmware/pipeline/camera_groups.hpp"
#include "firmware/pipeline/existing_model.hpp"
#include "firmware/pipeline/memory_plan.hpp"
#include "firmware/pipeline/photo_set.hpp"
#include "firmware/pipeline/reconstruction.hpp"
#include "firmware/pipeline/report.hpp"
#include "firmware/pipeline/scale_stage.hpp"
#include "sfm/mapping/image_store.hpp"
#include "sfm/scene/outcome.hpp"

namespace trigmesh {

/// The models as they are published, and what became of each photograph.
struct FinishedModels {
  std::span<const ImageOutcome> outcomes;
  const ScaledModels& scaled;
};

/// A report on photographs that were mapped; `pairs` are all that were compared.
[[nodiscard]] ReconstructionReport report_on(const PhotoSet& photos,
                                             const ReconstructionOptions& options,
                                             const MemoryPlan& plan,
                                             const CameraGroups& cameras,
                                             const std::vector<PairRecord>& pairs,
                                             const FinishedModels& models);

/// A report on a model that was made before.
[[nodiscard]] ReconstructionReport report_on_model(const PhotoSet& photos,
                                                   const ReconstructionOptions& options,
                                                   const ExistingModel& model);

}  // namespace trigmesh
