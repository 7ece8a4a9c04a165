#include "firmware/pipeline/mapping_stage.hpp"

#include <cmath>
#include <functional>
#include <map>

#include "firmware/base/check.hpp"
#include "sfm/mapping/known_poses.hpp"

namespace trigmesh {

namespace {

void color_landmarks(Scene& scene, const std::vector<ExtractedImage>& images) {
  for (Landmark& landmark : scene.landmarks) {
    std::array<unsigned, 3> sum{};
    for (const Observation& observation : landmark.track) {
      const Rgb& color =
          images[index(observation.view)].features->colors[index(observation.feature)];
      for (std::size_t c = 0; c < 3; ++c) {
        sum[c] += color[c];
      }
    }
    const auto count = static_cast<unsigned>(landmark.track.size());
    for (std::size_t c = 0; c < 3; ++c) {
      landmark.color_rgb[c] = static_cast<std::uint8_t>((sum[c] + count / 2) / count);
    }
  }
}

RefusalReason reason_of(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInvalidArgument:
      return RefusalReason::kTooSmall;
    case ErrorCode::kInsufficientData:
      return RefusalReason::kDuplicate;
    default:
      return RefusalReason::kUnreadable;
  }
}

/// Colours for the points, and for photographs that could not be read the reason.
void complete(const std::vector<ExtractedImage>& images, MappedPhotos& result) {
  for (Scene& scene : result.components) {
    color_landmarks(scene, images);
  }
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (!images[i].features) {
      result.outcomes[i].reason = reason_of(images[i].error.code);
      result.outcomes[i].detail = images[i].error.message;
    }
  }
}

/// Outcome of an image whose pose was given or not.
ImageOutcome outcome_of(const Scene& scene, const View& view, std::size_t features) {
  ImageOutcome outcome;
  outcome.name = view.name;
  outcome.features = features;
  if (!view.cam_from_world) {
    outcome.reason = RefusalReason::kNoGivenPose;
    outcome.detail = "the given model has no pose for it";
    return outcome;
  }
  outcome.component = 0;
  double squares = 0.0;
  for (std::size_t k = 0; k < view.landmarks.size(); ++k) {
    if (view.landmarks[k] == kNoLandmark) {
      continue;
    }
    ++outcome.observations;
    const Eigen::Vector3d in_cam =
        *view.cam_from_world * scene.landmarks[index(view.landmarks[k])].position_in_world;
    if (const auto pixel = project(scene.cameras[index(view.camera)], in_cam)) {
      squares += (*pixel - view.keypoints_px[k].cast<double>()).squaredNorm();
    }
  }
  if (outcome.observations > 0) {
    outcome.rmse_px = std::sqrt(squares / static_cast<double>(outcome.observations));
  }
  return outcome;
}

MapperImage mapper_image(const std::string& name, CameraId camera, const ExtractedImage& image) {
  return {
      name, camera, image.features ? image.features->features.keypoints : std::vector<Keypoint>{}};
}

}  // namespace

Result<MappedPhotos> map_known_poses(const PhotoSet& photos,
                                     const std::vector<ExtractedImage>& images,
                                     const CameraGroups& cameras,
                                     const std::vector<PairRecord>& pairs,
                                     const KnownPoseMapping& mapping,
                                     const StageContext& context) {
  std::map<std::string, Rigid3, std::less<>> poses;
  for (const View& view : mapping.model.views) {
    if (view.cam_from_world) {
      poses.emplace(view.name, *view.cam_from_world);
    }
  }
  std::vector<Camera> group_cameras;
  for (const CameraGroup& group : cameras.groups) {
    group_cameras.push_back(group.camera);
  }
  std::vector<PosedImage> posed;
  for (std::size_t i = 0; i < images.size(); ++i) {
    PosedImage image{mapper_image(photos.names[i], cameras.group_of_image[i], images[i]), {}};
    if (const auto pose = poses.find(photos.names[i]); pose != poses.end() && images[i].features) {
      image.cam_from_world = pose->second;
    }
    posed.push_back(std::move(image));
  }
  context.listener.on_progress({Stage::kMap, 0, images.size()});
  TM_ASSIGN_OR_RETURN(
      Scene scene,
      triangulate_known_poses(group_cameras, posed, pairs, mapping.options, context.executor));
  context.listener.on_progress({Stage::kMap, images.size(), images.size()});
  if (scene.registered_count() == 0) {
    return fail(ErrorCode::kInsufficientData,
                "none of the {} photographs has a pose in the given model: names must be equal, "
                "relative to the image folder",
                images.size());
  }
  MappedPhotos result;
  for (const View& view : scene.views) {
    const std::size_t i = result.outcomes.size();
    result.outcomes.push_back(outcome_of(scene, view, posed[i].image.keypoints.size()));
  }
  result.components.push_back(std::move(scene));
  complete(images, result);
  return result;
}

Result<CameraGroups> groups_of_model(const PhotoSet& photos,
                                     const std::vector<ExtractedImage>& images,
                                     const Scene& model) {
  std::map<std::string, CameraId, std::less<>> camera_of;
  for (const View& view : model.views) {
    camera_of.emplace(view.name, view.camera);
  }
  CameraGroups groups;
  for (const Camera& camera : model.cameras) {
    groups.groups.push_back({camera, IntrinsicsKnowledge::kGiven});
  }
  for (std::size_t i = 0; i < images.size(); ++i) {
    const auto found = camera_of.find(photos.names[i]);
    groups.group_of_image.push_back(found == camera_of.end() ? CameraId{0} : found->second);
    const Camera& camera = model.cameras[index(groups.group_of_image.back())];
    if (found != camera_of.end() && images[i].features &&
        (camera.width_px != images[i].features->width_px ||
         camera.height_px != images[i].features->height_px)) {
      return fail(ErrorCode::kInvalidArgument,
                  "{} has {}x{} pixels, its camera in the given model {}x{}",
                  photos.names[i],
                  images[i].features->width_px,
                  images[i].features->height_px,
                  camera.width_px,
                  camera.height_px);
    }
  }
  return groups;
}

Result<MappedPhotos> map_photos(const PhotoSet& photos,
                                const std::vector<ExtractedImage>& images,
                                const CameraGroups& cameras,
                                const std::vector<PairRecord>& pairs,
                                const MapperOptions& options,
                                const StageContext& context) {
  TM_ASSIGN_OR_RETURN(Mapper mapper, Mapper::create(options, context.executor));
  for (const CameraGroup& group : cameras.groups) {
    mapper.add_camera(group.camera, group.knowledge);
  }
  for (std::size_t i = 0; i < images.size(); ++i) {
    mapper.add_image(mapper_image(photos.names[i], cameras.group_of_image[i], images[i]));
  }
  for (const std::size_t i : strongest_first(pairs)) {
    mapper.add_pair(pairs[i].pair, pairs[i].geometry);
  }
  context.listener.on_progress({Stage::kMap, 0, images.size()});
  while (mapper.step().kind != StepKind::kNothing) {
    context.listener.on_progress({Stage::kMap, mapper.registered_count(), images.size()});
    if (context.stop.stop_requested()) {
      return fail(ErrorCode::kCancelled, "stopped while mapping; features and matches are kept");
    }
  }
  mapper.finish();
  MappedPhotos result{mapper.components(), mapper.outcomes()};
  complete(images, result);
  return result;
}

}  // namespace trigmesh
