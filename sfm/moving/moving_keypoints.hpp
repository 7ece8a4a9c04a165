#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "sfm/features/features.hpp"
#include "sfm/moving/contradicting_features.hpp"

namespace trigmesh {

/// How keypoints without evidence of their own are judged by those around them.
struct SurroundingsOptions {
  /// Nearest keypoints with evidence that are asked, >= 1.
  std::size_t neighbors = 8;
  /// Farther away than this nothing is asked, pixels, > 0.
  double max_distance_px = 40.0;
  /// Part of those asked that must have moved, (0.5, 1].
  double min_moved_ratio = 0.6;
  /// Fewer keypoints of a view that moved are an accident, >= 1.
  std::size_t min_moved = 12;

  /// Names the field, its value and the violated rule.
  [[nodiscard]] Result<> validate() const;
};

/// Per keypoint of a view 1 when it lies on something that moved: most of the keypoints with
/// evidence around it have. Matches on such things agree with the poses by chance now and then;
/// their surroundings tell them from the scene. `evidence`: of keypoints of the same picture.
/// Precondition: `options.validate()`.
[[nodiscard]] std::vector<std::uint8_t> moving_keypoints(std::span<const Keypoint> keypoints,
                                                         std::span<const FeatureEvidence> evidence,
                                                         const SurroundingsOptions& options);

}  // namespace trigmesh
