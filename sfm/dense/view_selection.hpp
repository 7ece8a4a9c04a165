#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "firmware/base/result.hpp"
#include "sfm/dense/dense_view.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// Which views help to estimate the depth of a view.
struct ViewSelectionOptions {
  /// Source views of a depth map, best first, [1, 8].
  std::size_t max_sources = 5;
  /// Views that a finished map is compared with, [max_sources, 32].
  std::size_t max_neighbors = 10;
  /// The triangulation angle that is worth most, degrees, (0, 60]; Y. Yao et al., "MVSNet", ECCV
  /// 2018, use 5.
  double best_angle_deg = 15.0;
  /// Decay of the worth below and above it, degrees, (0, 60].
  double narrow_sigma_deg = 5.0;
  double wide_sigma_deg = 12.0;

  /// Names the field, its value and the violated rule.
  [[nodiscard]] Result<> validate() const;
};

/// What the sparse model says about one view before its depth is known.
struct StereoPlan {
  std::vector<std::size_t> sources;  ///< positions in the views, best first; may be empty
  /// Positions of up to `max_neighbors` views that look at the same surfaces, the sources first:
  /// for filtering and fusion.
  std::vector<std::size_t> neighbors;
  std::vector<Eigen::Vector3f> seeds_in_cam;  ///< landmarks that the view sees
  float min_depth = 0.0F;                     ///< scene units; both 0 when nothing is known
  float max_depth = 0.0F;
};

/// A plan for each of the views of `scene` (dense_views): sources share landmarks with it under a
/// good angle at a like scale, and stand on different sides of it. Where views share too few
/// landmarks, points spread over the picture at the usual depth take their place. A view that sees
/// nothing that another one sees gets no sources. kInvalidArgument: options.
[[nodiscard]] Result<std::vector<StereoPlan>> plan_stereo(const Scene& scene,
                                                          std::span<const DenseView> views,
                                                          const ViewSelectionOptions& options);

}  // namespace trigmesh
