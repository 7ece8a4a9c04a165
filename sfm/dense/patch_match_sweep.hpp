#pragma once

#include <cstdint>
#include <vector>

#include "firmware/base/executor.hpp"
#include "sfm/dense/plane_field.hpp"
#include "sfm/dense/stereo_level.hpp"

namespace trigmesh {

/// How far a sweep looks for better planes.
enum class SweepSearch {
  kWide,  ///< anywhere in the depth range, for the coarse sizes
  kFine,  ///< near what is known
};

/// One pass over a field: everything but the field itself.
struct SweepPlan {
  const StereoLevel* level = nullptr;  ///< outlives the pass
  InverseDepthRange range;
  SweepSearch search = SweepSearch::kWide;
  float step_px = 0.5F;  ///< refinement step, as disparity in the source that sees it largest
  float grey_sigma = 12.0F;
  float geometric_weight = 0.0F;  ///< cost of 1 px; 0: photometric only
  std::uint64_t seed = 1;         ///< of this pass
  /// Further planes to try, each as large as the field (inverse depth 0: none there).
  const std::vector<std::vector<PlaneHypothesis>>* hints = nullptr;
};

/// Gives random planes to the pixels that have none (and to some that have one, so that a wrong
/// first surface is doubted), and every pixel its cost. Masked pixels lose their plane.
void initialize_field(const SweepPlan& plan, PlaneField& field, Executor& executor);

/// Updates all pixels of one colour of a checkerboard from their neighbours of the other colour,
/// then the others.
void sweep_field(const SweepPlan& plan, PlaneField& field, Executor& executor);

}  // namespace trigmesh
