#pragma once

#include <cstddef>
#include <vector>

#include "firmware/base/result.hpp"
#include "sfm/matching/descriptor_matcher.hpp"
#include "sfm/matching/guided_matcher.hpp"
#include "sfm/matching/matches.hpp"
#include "sfm/matching/two_view_verification.hpp"

namespace trigmesh {

/// One image, ready to be compared with others.
struct MatchableImage {
  DescriptorIndex index;
  /// Undistorted pixels, one for each descriptor; not-a-number where a pixel has no ray.
  std::vector<Eigen::Vector2d> points_px;
  int width_px = 0;
  int height_px = 0;
  std::optional<Eigen::Matrix3d> calibration;  ///< 3x3 K when it is known, at least roughly
};

/// How a pair of images is compared.
struct PairMatchingOptions {
  /// The coarsest features of each image that are compared without knowing the geometry, > 0.
  std::size_t coarse_features = 2000;
  /// When these have no verified geometry but at least so many matches, all features are compared.
  std::size_t min_matches_for_all = 25;
  MatchOptions matching;
  GuidedMatchOptions guided;
  VerificationOptions verification;
};

/// Matches and verifies a pair. The geometry comes from the coarsest features, which cost little;
/// all features are then matched along epipolar lines, which finds more matches than comparing
/// every feature with every other, and the geometry is estimated again from them. Deterministic.
[[nodiscard]] TwoViewGeometry match_pair(const MatchableImage& first,
                                         const MatchableImage& second,
                                         const PairMatchingOptions& options);

}  // namespace trigmesh
