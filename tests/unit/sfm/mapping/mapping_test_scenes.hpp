#pragma once

#include <algorithm>
#include <cstring>
#include <span>
#include <vector>

#include "firmware/base/executor.hpp"
#include "sfm/mapping/image_store.hpp"
#include "sfm/mapping/map.hpp"
#include "sfm/mapping/mapper.hpp"
#include "sfm/mapping/track_table.hpp"
#include "tests/support/synthetic_scene.hpp"

// What the tests of mapping share.

namespace trigmesh::mapping_test {

/// Does the pieces of work last first: what must not matter when threads do them.
class ReversedExecutor final : public Executor {
 public:
  void for_each_index(std::size_t count, const std::function<void(std::size_t)>& work) override {
    for (std::size_t i = count; i > 0; --i) {
      work(i - 1);
    }
  }
};

/// The pairs with most matches first, as the mapper wants them.
inline std::vector<test_support::SyntheticPair> strongest_first(
    std::vector<test_support::SyntheticPair> pairs) {
  std::stable_sort(pairs.begin(), pairs.end(), [](const auto& a, const auto& b) {
    return a.geometry.inliers.size() > b.geometry.inliers.size();
  });
  return pairs;
}

/// A store that knows all images and pairs of a scene; nothing is registered.
inline ImageStore make_store(const test_support::SyntheticScene& scene) {
  ImageStore store;
  for (const Camera& camera : scene.truth.cameras) {
    store.cameras.push_back({camera, IntrinsicsKnowledge::kGiven});
  }
  for (const View& view : scene.truth.views) {
    store.images.push_back({view.name, view.camera, view.keypoints_px, {}, {}, false});
    store.tracks.add_view(view.keypoints_px.size());
    store.sigmas_px.emplace_back(view.keypoints_px.size(), 1.0F);
  }
  for (const auto& [pair, geometry] : strongest_first(scene.pairs)) {
    store.images[index(pair.first)].pairs.push_back(store.pairs.size());
    store.images[index(pair.second)].pairs.push_back(store.pairs.size());
    store.pairs.push_back({pair, geometry});
    (void)store.tracks.add_matches(pair, geometry.inliers);  // no map yet that could follow
  }
  return store;
}

/// A map of all views of a scene, none of them registered.
inline Map make_map(const TrackTable& tracks, const Scene& scene) {
  Map map(tracks);
  for (const Camera& camera : scene.cameras) {
    map.add_camera(camera);
  }
  for (const View& view : scene.views) {
    map.add_view({view.name, view.camera, std::nullopt, view.keypoints_px, {}});
  }
  return map;
}

/// Gives views [begin, end) their true poses.
inline void register_truth(Map& map, const Scene& truth, std::size_t begin, std::size_t end) {
  for (std::size_t i = begin; i < end; ++i) {
    map.register_view(id_of<ViewId>(i), *truth.views[i].cam_from_world);
  }
}

/// The track of a true landmark, or kNoTrack when its first keypoint was never matched.
inline TrackId track_of(const TrackTable& tracks, const Landmark& landmark) {
  return tracks.track_of(landmark.track.front());
}

/// An image of a scene as it is given to the mapper.
inline MapperImage mapper_image(const View& view) {
  MapperImage image{view.name, view.camera, {}};
  for (const Eigen::Vector2f& pixel : view.keypoints_px) {
    image.keypoints.push_back({.x_px = pixel.x(), .y_px = pixel.y(), .scale_px = 2.0F});
  }
  return image;
}

inline void add_cameras(Mapper& mapper, const Scene& truth, IntrinsicsKnowledge knowledge) {
  for (Camera camera : truth.cameras) {
    if (knowledge == IntrinsicsKnowledge::kUnknown) {
      camera.fx_px = camera.fy_px = 1.2 * std::max(camera.width_px, camera.height_px);
    }
    (void)mapper.add_camera(camera, knowledge);  // cameras get their ids in this order
  }
}

/// A mapper that was given everything and has done nothing yet.
inline Mapper make_mapper(const test_support::SyntheticScene& scene,
                          IntrinsicsKnowledge knowledge,
                          Executor& executor,
                          const MapperOptions& options = {}) {
  Mapper mapper = Mapper::create(options, executor).value();
  add_cameras(mapper, scene.truth, knowledge);
  for (const View& view : scene.truth.views) {
    (void)mapper.add_image(mapper_image(view));  // views get their ids in this order
  }
  for (const auto& [pair, geometry] : strongest_first(scene.pairs)) {
    mapper.add_pair(pair, geometry);
  }
  return mapper;
}

/// Steps until nothing more can be done; gives up when that does not come to an end.
inline void step_to_the_end(Mapper& mapper) {
  for (std::size_t i = 0; i < 4 * mapper.image_count() + 4; ++i) {
    if (mapper.step().kind == StepKind::kNothing) {
      return;
    }
  }
}

/// All at once with the executor of a single thread.
inline Mapper map_scene(const test_support::SyntheticScene& scene,
                        IntrinsicsKnowledge knowledge = IntrinsicsKnowledge::kGiven,
                        const MapperOptions& options = {}) {
  static SerialExecutor executor;
  Mapper mapper = make_mapper(scene, knowledge, executor, options);
  step_to_the_end(mapper);
  mapper.finish();
  return mapper;
}

/// The truth as far as one component goes.
inline Scene truth_of_component(const test_support::SyntheticScene& scene, std::size_t component) {
  Scene truth = scene.truth;
  for (std::size_t i = 0; i < truth.views.size(); ++i) {
    if (scene.component_of_view[i] != component) {
      truth.views[i].cam_from_world.reset();
    }
  }
  return truth;
}

}  // namespace trigmesh::mapping_test
