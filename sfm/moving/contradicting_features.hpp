#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "firmware/base/executor.hpp"
#include "firmware/base/result.hpp"
#include "sfm/features/features.hpp"
#include "sfm/moving/moving_view.hpp"

namespace trigmesh {

/// When features count as seen to move.
struct ContradictionOptions {
  /// Most keypoints of a view, [16, 100000].
  int max_keypoints = 2500;
  /// Views that a view is compared with, >= 1: its neighbours, then such that are spread evenly
  /// over all.
  std::size_t max_partners = 24;
  /// A match within this distance of the epipolar geometry of the poses agrees with them, beyond
  /// `min_contradiction_px` it contradicts, pixels, 0 < agreement <= contradiction.
  double max_agreement_px = 2.0;
  double min_contradiction_px = 4.0;
  /// Contradicting matches of two views that must follow one epipolar geometry of their own: a
  /// thing that moved is rigid from one view to the next, chance is not. >= 8.
  std::size_t min_common_motion = 10;

  /// Names the field, its value and the violated rule.
  [[nodiscard]] Result<> validate() const;
};

/// A keypoint and how many views say what of it.
struct FeatureEvidence {
  Keypoint keypoint;
  std::size_t agreeing = 0;       ///< its match there is where the poses expect it
  std::size_t contradicting = 0;  ///< it matches another place there, as others around it do
};

/// SIFT keypoints of all views with the evidence from their matches. Keypoints on surfaces that
/// other views confirm (`depth`) or that are left out (`mask`) cannot contradict. A view smaller
/// than 16x16 has none. Deterministic for any executor. kInvalidArgument: options.
[[nodiscard]] Result<std::vector<std::vector<FeatureEvidence>>> find_contradicting_features(
    std::span<const MovingView> views, const ContradictionOptions& options, Executor& executor);

}  // namespace trigmesh
