#include "sfm/mapping/known_poses.hpp"

#include "firmware/base/check.hpp"
#include "sfm/mapping/map.hpp"
#include "sfm/mapping/structure.hpp"

namespace trigmesh {

namespace {

Result<> check(const std::vector<Camera>& cameras,
               const std::vector<PosedImage>& images,
               std::span<const PairRecord> pairs) {
  for (const PosedImage& image : images) {
    if (index(image.image.camera) >= cameras.size()) {
      return fail(ErrorCode::kInvalidArgument,
                  "{} names camera {} of {}",
                  image.image.name,
                  index(image.image.camera),
                  cameras.size());
    }
  }
  for (const PairRecord& record : pairs) {
    if (!(record.pair.first < record.pair.second) || index(record.pair.second) >= images.size()) {
      return fail(ErrorCode::kInvalidArgument,
                  "a pair names images {} and {} of {}",
                  index(record.pair.first),
                  index(record.pair.second),
                  images.size());
    }
  }
  return {};
}

TrackTable make_tracks(const std::vector<PosedImage>& images, std::span<const PairRecord> pairs) {
  TrackTable tracks;
  for (const PosedImage& image : images) {
    tracks.add_view(image.image.keypoints.size());
  }
  for (const std::size_t i : strongest_first(pairs)) {
    (void)tracks.add_matches(pairs[i].pair, pairs[i].geometry.inliers);  // no landmarks exist yet
  }
  return tracks;
}

Map make_map(const TrackTable& tracks,
             const std::vector<Camera>& cameras,
             const std::vector<PosedImage>& images) {
  Map map(tracks);
  for (const Camera& camera : cameras) {
    map.add_camera(camera);
  }
  for (std::size_t i = 0; i < images.size(); ++i) {
    View view{images[i].image.name, images[i].image.camera, std::nullopt, {}, {}};
    for (const Keypoint& keypoint : images[i].image.keypoints) {
      view.keypoints_px.emplace_back(keypoint.x_px, keypoint.y_px);
    }
    map.add_view(std::move(view));
  }
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (images[i].cam_from_world) {
      map.register_view(id_of<ViewId>(i), *images[i].cam_from_world);
    }
  }
  return map;
}

}  // namespace

Result<Scene> triangulate_known_poses(const std::vector<Camera>& cameras,
                                      const std::vector<PosedImage>& images,
                                      std::span<const PairRecord> pairs,
                                      const MapperOptions& options,
                                      Executor& executor) {
  TM_RETURN_IF_ERROR(options.validate());
  TM_RETURN_IF_ERROR(check(cameras, images, pairs));
  const TrackTable tracks = make_tracks(images, pairs);
  Map map = make_map(tracks, cameras, images);
  const Structure structure(tracks, options, executor);
  (void)structure.triangulate_all(map);
  (void)structure.filter(map, options.final_reprojection_px);
  (void)structure.complete(map);
  structure.reposition(map);
  (void)structure.filter(map, options.final_reprojection_px);
  return map.compact();
}

}  // namespace trigmesh
