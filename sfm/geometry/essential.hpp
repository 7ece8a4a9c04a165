#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string_view>

#include <Eigen/Core>

#include "sfm/geometry/rigid3.hpp"
#include "sfm/geometry/sampling.hpp"

namespace trigmesh {

/// The four relative poses of an essential matrix, |t| = 1: (R1, t), (R1, -t), (R2, t), (R2, -t).
[[nodiscard]] std::array<Rigid3, 4> decompose_essential(const Eigen::Matrix3d& essential);

/// How a match lies with respect to two cameras.
struct TwoViewDepths {
  double first = 0.0;      ///< z of the nearest point of both rays in the first camera; unit: |t|
  double second = 0.0;     ///< and in the second
  double angle_rad = 0.0;  ///< between the rays; at 0 the depths are not determined (and 0)
};

/// Depths along the two rays where they come nearest to each other. Normalised coordinates (x/z,
/// y/z).
[[nodiscard]] TwoViewDepths two_view_depths(const Rigid3& second_from_first,
                                            const Eigen::Vector2d& first,
                                            const Eigen::Vector2d& second);

enum class CheiralityOutcome {
  kOk,
  kTooFewPoints,  ///< no match has rays that differ by `min_angle_rad`: nothing says where front is
  kTooFewInFront,  ///< no pose has half of those matches in front of both cameras
  kAmbiguous,      ///< a second pose has nearly as many
};

/// "ok", "too_few_points", "too_few_in_front", "ambiguous".
[[nodiscard]] std::string_view to_string(CheiralityOutcome outcome);

struct PoseChoice {
  CheiralityOutcome outcome = CheiralityOutcome::kTooFewPoints;
  Rigid3 second_from_first;
  std::size_t in_front = 0;   ///< matches in front of both cameras, for the chosen pose
  std::size_t runner_up = 0;  ///< and for the next best
  std::size_t judged = 0;     ///< matches with rays apart enough to tell, for the chosen pose
};

/// Which matches may decide the choice.
struct CheiralityOptions {
  /// Rays nearer than this to parallel do not count: noise decides on which side they meet.
  /// Radians, >= 0.
  double min_angle_rad = 1e-3;
  /// The next best pose must have less than this part of the best one's matches, (0, 1].
  double max_runner_up_ratio = 0.8;
};

/// The pose of the four that has most matches in front of both cameras. Normalised coordinates;
/// first[i] matches second[i]; `mask`: the matches to use (empty: all).
[[nodiscard]] PoseChoice choose_pose(const Eigen::Matrix3d& essential,
                                     std::span<const Eigen::Vector2d> first,
                                     std::span<const Eigen::Vector2d> second,
                                     std::span<const std::uint8_t> mask,
                                     const CheiralityOptions& options);

}  // namespace trigmesh
