#include <algorithm>

#include "firmware/base/check.hpp"
#include "sfm/mapping/bundle_adjustment.hpp"

namespace trigmesh {
namespace {

/// Registered views outside `is_variable` with how many of the landmarks they see, by view.
std::vector<std::size_t> count_shared(const Scene& scene,
                                      const std::vector<LandmarkId>& landmarks,
                                      const std::vector<char>& is_variable) {
  std::vector<std::size_t> shared(scene.views.size(), 0);
  for (const LandmarkId id : landmarks) {
    for (const Observation& seen : scene.landmarks[index(id)].track) {
      const std::size_t view = index(seen.view);
      if (is_variable[view] == 0 && scene.views[view].cam_from_world.has_value()) {
        ++shared[view];
      }
    }
  }
  return shared;
}

}  // namespace

BundleSelection select_everything(const Scene& scene) {
  BundleSelection selection;
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    if (scene.views[i].cam_from_world.has_value()) {
      selection.variable_views.push_back(id_of<ViewId>(i));
    }
  }
  for (std::size_t i = 0; i < scene.landmarks.size(); ++i) {
    selection.landmarks.push_back(id_of<LandmarkId>(i));
  }
  return selection;
}

BundleSelection select_around(const Scene& scene,
                              std::span<const ViewId> variable_views,
                              std::size_t min_shared) {
  BundleSelection selection;
  selection.variable_views.assign(variable_views.begin(), variable_views.end());
  std::vector<char> is_variable(scene.views.size(), 0);
  for (const ViewId id : variable_views) {
    TM_CHECK(index(id) < scene.views.size());
    is_variable[index(id)] = 1;
    for (const LandmarkId landmark : scene.views[index(id)].landmarks) {
      if (landmark != kNoLandmark) {
        selection.landmarks.push_back(landmark);
      }
    }
  }
  std::sort(selection.landmarks.begin(), selection.landmarks.end());
  selection.landmarks.erase(std::unique(selection.landmarks.begin(), selection.landmarks.end()),
                            selection.landmarks.end());
  const std::vector<std::size_t> shared = count_shared(scene, selection.landmarks, is_variable);
  const auto most = std::max_element(shared.begin(), shared.end());
  for (auto it = shared.begin(); it != shared.end(); ++it) {
    if (*it > 0 && (*it >= min_shared || it == most)) {
      selection.constant_views.push_back(
          id_of<ViewId>(static_cast<std::size_t>(it - shared.begin())));
    }
  }
  return selection;
}

}  // namespace trigmesh
