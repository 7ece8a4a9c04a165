#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "firmware/base/executor.hpp"
#include "firmware/base/result.hpp"
#include "sfm/dense/dense_cloud.hpp"
#include "sfm/dense/dense_view.hpp"
#include "sfm/dense/depth_map.hpp"
#include "sfm/dense/map_agreement.hpp"

namespace trigmesh {

/// How filtered depth maps become one cloud.
struct FusionOptions {
  AgreementOptions agreement;
  /// Views, the first included, that a point is made of at least, [1, 16].
  std::size_t min_views = 2;
  /// Points of the cloud at most, > 0.
  std::size_t max_points = 100'000'000;

  /// Names the field, its value and the violated rule.
  [[nodiscard]] Result<> validate() const;
};

/// What is fused. Everything outlives the call.
struct FusionInput {
  std::span<const DenseView> views;
  /// Per view: the others whose maps may hold the same surface (StereoPlan::neighbors).
  std::span<const std::vector<std::size_t>> neighbors;
  const DepthMapSource* maps = nullptr;     ///< filtered
  const ViewImageSource* images = nullptr;  ///< for the colours
};

/// Every surface element once: pixels of several views that agree become one point at their mean
/// position, with their mean normal and colour. Views are visited in order; a pixel that went into
/// a point starts no other. Deterministic. Holds the maps and pictures of a view and its
/// neighbours, one byte for each pixel of all maps, and the cloud. Errors of the sources;
/// kInvalidArgument: options, lists of different length; kLimitExceeded: more than max_points.
[[nodiscard]] Result<DenseCloud> fuse_depth_maps(const FusionInput& input,
                                                 const FusionOptions& options,
                                                 Executor& executor);

}  // namespace trigmesh
