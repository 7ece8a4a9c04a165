#pragma once

#include <span>
#include <vector>

#include "firmware/base/executor.hpp"
#include "sfm/mapping/bundle_adjustment.hpp"
#include "sfm/mapping/map.hpp"
#include "sfm/mapping/mapper.hpp"

namespace trigmesh {

/// Which parts of a map are adjusted when, and which intrinsics are free at which size of the
/// model.
class ModelAdjustment {
 public:
  /// All outlive the object; `sigmas_px[view][feature]` grows as views are added.
  ModelAdjustment(const MapperOptions& options,
                  const std::vector<std::vector<float>>& sigmas_px,
                  Executor& executor)
      : options_(&options), sigmas_px_(&sigmas_px), executor_(&executor) {}

  void add_camera(const Camera& prior, IntrinsicsKnowledge knowledge);

  /// The new view with those that share most landmarks with it; all others that see the same things
  /// are held.
  BundleReport adjust_around(Map& map, ViewId view) const;
  /// All views, on the landmarks with the longest tracks (`landmarks_per_view`): fast, while the
  /// model grows.
  BundleReport adjust_skeleton(Map& map) const;
  /// All views and all landmarks, until it converges, with at most `max_iterations` (>= 1) steps.
  BundleReport adjust_all(Map& map, int max_iterations) const;

 private:
  [[nodiscard]] BundleOptions bundle_options(const Map& map) const;
  [[nodiscard]] std::vector<LandmarkId> spread_landmarks(const Map& map,
                                                         std::span<const LandmarkId> from) const;

  struct Knowledge {
    Camera prior;
    IntrinsicsKnowledge knowledge = IntrinsicsKnowledge::kGiven;
  };

  const MapperOptions* options_;
  const std::vector<std::vector<float>>* sigmas_px_;
  Executor* executor_;
  std::vector<Knowledge> cameras_;
};

}  // namespace trigmesh
