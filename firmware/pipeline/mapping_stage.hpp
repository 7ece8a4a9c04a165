#pragma once

#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/pipeline/camera_groups.hpp"
#include "firmware/pipeline/extraction_stage.hpp"
#include "firmware/pipeline/reconstruction.hpp"
#include "firmware/pipeline/stage_context.hpp"
#include "sfm/mapping/image_store.hpp"

namespace trigmesh {

/// What mapping found: models, largest first, coloured; and what became of each photograph, in
/// input order.
struct MappedPhotos {
  std::vector<Scene> components;
  std::vector<ImageOutcome> outcomes;
};

/// Gives all images and pairs to the mapper, strongest pairs first, and lets it work until nothing
/// can be added. Errors: kCancelled, kInvalidArgument (options).
[[nodiscard]] Result<MappedPhotos> map_photos(const PhotoSet& photos,
                                              const std::vector<ExtractedImage>& images,
                                              const CameraGroups& cameras,
                                              const std::vector<PairRecord>& pairs,
                                              const MapperOptions& options,
                                              const StageContext& context);

/// A model whose cameras and poses are taken as they are.
struct KnownPoseMapping {
  const Scene& model;  ///< its points are not used
  MapperOptions options;
};

/// The intrinsics of a given model, by the names of its images. kInvalidArgument when a photograph
/// has another size than its camera.
[[nodiscard]] Result<CameraGroups> groups_of_model(const PhotoSet& photos,
                                                   const std::vector<ExtractedImage>& images,
                                                   const Scene& model);

/// Triangulates the matches from the poses of a given model; photographs that it does not name are
/// refused. kInsufficientData when it names none.
[[nodiscard]] Result<MappedPhotos> map_known_poses(const PhotoSet& photos,
                                                   const std::vector<ExtractedImage>& images,
                                                   const CameraGroups& cameras,
                                                   const std::vector<PairRecord>& pairs,
                                                   const KnownPoseMapping& mapping,
                                                   const StageContext& context);

}  // namespace trigmesh
