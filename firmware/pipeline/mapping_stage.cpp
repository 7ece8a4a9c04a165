#include "firmware/pipeline/mapping_stage.hpp"

#include <algorithm>
#include <numeric>

#include "firmware/base/check.hpp"

namespace trigmesh {

namespace {

std::vector<std::size_t> strongest_first(const std::vector<PairRecord>& pairs) {
  std::vector<std::size_t> order(pairs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return pairs[a].geometry.inliers.size() > pairs[b].geometry.inliers.size();
  });
  return order;
}

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

}  // namespace

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
    MapperImage image{photos.names[i], cameras.group_of_image[i], {}};
    if (images[i].features) {
      image.keypoints = images[i].features->features.keypoints;
    }
    mapper.add_image(std::move(image));
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
  for (Scene& scene : result.components) {
    color_landmarks(scene, images);
  }
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (!images[i].features) {
      result.outcomes[i].reason = reason_of(images[i].error.code);
      result.outcomes[i].detail = images[i].error.message;
    }
  }
  return result;
}

}  // namespace trigmesh
