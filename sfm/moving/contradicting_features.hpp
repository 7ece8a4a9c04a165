#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "firmware/base/executor.hpp"
#include "firmware/base/result.hpp"
#include "sfm/camera/camera.hpp"
#include "sfm/features/features.hpp"
#include "sfm/geometry/rigid3.hpp"
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

/// Whether a keypoint counts as seen to move.
[[nodiscard]] bool has_moved(const FeatureEvidence& evidence);

/// The keypoints of one view with all that their comparison needs. Borrows nothing.
struct ComparableView {
  FeatureSet features;
  std::vector<Eigen::Vector2d> points_px;  ///< undistorted; not-a-number where a pixel has no ray
  std::vector<std::uint8_t> open;          ///< per keypoint: 0 = it cannot contradict
  Camera camera;                           ///< kPinhole, of the undistorted pixels
  Rigid3 cam_from_world;
  std::vector<std::size_t> neighbors;  ///< positions of views that look at the same things
};

/// Evidence for the first `max_keypoints` (the coarsest) of each view. Lengths in the options are
/// those of the cameras' pixels. Deterministic for any executor. kInvalidArgument: options,
/// descriptors that do not fit.
[[nodiscard]] Result<std::vector<std::vector<FeatureEvidence>>> compare_views(
    std::vector<ComparableView> views, const ContradictionOptions& options, Executor& executor);

/// SIFT keypoints of all views with the evidence from their matches. Keypoints on surfaces that
/// other views confirm (`depth`) or that are left out (`mask`) cannot contradict. A view smaller
/// than 16x16 has none. Deterministic for any executor. kInvalidArgument: options.
[[nodiscard]] Result<std::vector<std::vector<FeatureEvidence>>> find_contradicting_features(
    std::span<const MovingView> views, const ContradictionOptions& options, Executor& executor);

}  // namespace trigmesh
