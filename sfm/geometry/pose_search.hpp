// The parts that sampling for a pose and sampling for a pose with focal length share: scoring,
// improving on inliers, reporting. Not for use outside this folder.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "sfm/camera/camera.hpp"
#include "sfm/geometry/absolute_pose.hpp"
#include "sfm/geometry/p3p.hpp"
#include "sfm/geometry/pose_refinement.hpp"
#include "sfm/geometry/robust_score.hpp"
#include "sfm/geometry/sampling.hpp"

namespace trigmesh::pose_search {

inline constexpr std::size_t kSampleSize = 3;
/// Three matches give up to four poses and nothing to choose between them.
inline constexpr std::size_t kMinPoints = 4;

/// The matches of one estimation, in a fixed random order for the sequential test.
class Matches {
 public:
  /// The spans outlive this object.
  Matches(std::span<const Eigen::Vector2d> pixels,
          std::span<const Eigen::Vector3d> points_in_world,
          RandomGenerator& random);

  [[nodiscard]] std::size_t size() const { return pixels_.size(); }

  [[nodiscard]] std::span<const Eigen::Vector2d> pixels() const { return pixels_; }

  [[nodiscard]] std::span<const Eigen::Vector3d> points_in_world() const { return points_; }

  /// Score over all matches; infinite as soon as it is plain that the pose is not better than
  /// `best`.
  [[nodiscard]] Score score(const PosedCamera& posed, double max_error_px, const Score& best) const;

  /// Marks who agrees, `mask[i]` for match i, without any shortcut.
  [[nodiscard]] Score mark(const PosedCamera& posed,
                           double max_error_px,
                           std::span<std::uint8_t> mask) const;

 private:
  [[nodiscard]] double squared_error(const PosedCamera& posed,
                                     const Eigen::Matrix3d& rotation,
                                     std::size_t i) const;

  std::span<const Eigen::Vector2d> pixels_;
  std::span<const Eigen::Vector3d> points_;
  std::vector<std::uint32_t> order_;
};

/// A camera pose with how well it does.
struct Candidate {
  PosedCamera posed;
  Score score{};
  bool determined = false;
  double focal_sigma_per_px = 0.0;
};

/// How `improve` goes about it.
struct ImproveOptions {
  double first_error_px =
      0.0;  ///< inlier threshold of the first fit, halved until it is `max_error_px`
  double max_error_px = 0.0;
  PoseUnknowns unknowns = PoseUnknowns::kPose;
};

/// Fits to the inliers and looks again who they are, as long as the cost falls.
[[nodiscard]] Candidate improve(const Matches& matches,
                                const PosedCamera& start,
                                const ImproveOptions& options);

/// What the caller learns of the best candidate.
[[nodiscard]] AbsolutePose report(const Matches& matches,
                                  const Candidate& best,
                                  const AbsolutePoseOptions& options);

/// The matches whose pixel has a ray, with that ray.
struct Rays {
  std::vector<std::uint32_t> match;
  std::vector<Eigen::Vector3d> in_cam;  ///< unit length
};

[[nodiscard]] Rays rays_of(const Camera& camera, std::span<const Eigen::Vector2d> pixels);

/// Poses from three entries of `rays`.
[[nodiscard]] P3pSolutions poses_of_sample(const Rays& rays,
                                           std::span<const Eigen::Vector3d> points_in_world,
                                           const std::array<std::uint32_t, kSampleSize>& sample);

}  // namespace trigmesh::pose_search
