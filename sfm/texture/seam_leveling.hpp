#pragma once

#include <span>
#include <vector>

#include <opencv2/core/mat.hpp>

#include "sfm/surface/triangle_mesh.hpp"
#include "sfm/texture/atlas_layout.hpp"
#include "sfm/texture/atlas_pictures.hpp"
#include "sfm/texture/charts.hpp"
#include "sfm/texture/view_gains.hpp"

namespace trigmesh {

struct SeamLeveling {
  CornerOffsets offsets;
  /// Mean step of colour across the seams, grey levels, mean over the channels: of the pictures as
  /// they are, after the gains, and after the offsets. 0 when there is no seam.
  double step_before = 0.0;
  double step_after_gains = 0.0;
  double step_after = 0.0;
};

/// What must be added to the colours of each chart so that charts agree where they meet and the
/// additions vary slowly inside. `pages` hold the copied pictures before finish_charts. O(vertices)
/// unknowns, solved by a sparse Cholesky factorisation; additions are limited to +-kMostOffset.
[[nodiscard]] SeamLeveling level_seams(const TriangleMesh& mesh,
                                       const FaceNeighbors& neighbors,
                                       const AtlasLayout& layout,
                                       const std::vector<ColorGain>& gains,
                                       std::span<const cv::Mat> pages);

inline constexpr float kMostOffset = 80.0F;

}  // namespace trigmesh
