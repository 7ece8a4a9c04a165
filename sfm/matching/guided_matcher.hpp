#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "firmware/base/result.hpp"
#include "sfm/matching/descriptor_matcher.hpp"
#include "sfm/matching/matches.hpp"

namespace trigmesh {

/// How descriptors are paired when the epipolar geometry is known.
struct GuidedMatchOptions {
  /// Largest distance of either point from the epipolar line of the other, pixels, > 0.
  double max_error_px = 3.0;
  /// As in MatchOptions, but only points near the line are rivals.
  double max_ratio = 0.8;
  /// Largest distance of the descriptors, (0, 1]: a few rivals prove little, so a match must be
  /// good in itself. Dot product: Euclidean distance of the unit vectors divided by 2; Hamming:
  /// part of the bits that differ.
  double max_distance = 0.35;

  [[nodiscard]] Result<> validate() const;
};

/// The keypoints of one image for guided matching; all borrowed for the call.
struct GuidedImage {
  const DescriptorIndex& index;
  /// Undistorted pixels, one for each descriptor of the index.
  std::span<const Eigen::Vector2d> points_px;
};

/// Mutual nearest neighbours among the pairs near each other's epipolar line. Finds what the ratio
/// test over the whole image refuses (repeated texture). `fundamental`: 3x3, second^T F first = 0
/// in undistorted homogeneous pixels. Sorted by `first`. Points that are not finite match nothing.
[[nodiscard]] std::vector<FeatureMatch> match_guided(const GuidedImage& first,
                                                     const GuidedImage& second,
                                                     const Eigen::Matrix3d& fundamental,
                                                     const GuidedMatchOptions& options);

}  // namespace trigmesh
