// Pose of a camera from matches of pixels x_i and world points X_i, some of them wrong:
//
//   min over (R, t) of sum_i min(|project(R X_i + t) - x_i|^2, T^2)
//
// (MSAC: P. Torr, A. Zisserman, "MLESAC: A New Robust Estimator with Application to Estimating
// Image Geometry", CVIU 2000, equation 17) by samples of three (p3p.hpp), each promising pose
// improved on its inliers before it is compared (LO-RANSAC: O. Chum, J. Matas, J. Kittler, "Locally
// Optimized RANSAC", DAGM 2003).
#include "sfm/geometry/absolute_pose.hpp"

#include "firmware/base/check.hpp"
#include "sfm/geometry/pose_search.hpp"

namespace trigmesh {

namespace {

using pose_search::Candidate;
using pose_search::kMinPoints;
using pose_search::kSampleSize;
using pose_search::Matches;
using pose_search::Rays;

}  // namespace

Result<> AbsolutePoseOptions::validate() const {
  if (!(max_error_px > 0.0)) {
    return fail(ErrorCode::kInvalidArgument,
                "absolute pose max_error_px is {}, must be positive",
                max_error_px);
  }
  if (min_inliers < kMinPoints) {
    return fail(ErrorCode::kInvalidArgument,
                "absolute pose min_inliers is {}, must be at least {}",
                min_inliers,
                kMinPoints);
  }
  if (!(confidence > 0.0 && confidence < 1.0)) {
    return fail(ErrorCode::kInvalidArgument,
                "absolute pose confidence is {}, must be in (0, 1)",
                confidence);
  }
  if (max_iterations == 0) {
    return fail(ErrorCode::kInvalidArgument, "absolute pose max_iterations is 0");
  }
  return {};
}

std::string_view to_string(AbsolutePoseOutcome outcome) {
  switch (outcome) {
    case AbsolutePoseOutcome::kOk:
      return "ok";
    case AbsolutePoseOutcome::kTooFewPoints:
      return "too_few_points";
    case AbsolutePoseOutcome::kTooFewInliers:
      return "too_few_inliers";
    case AbsolutePoseOutcome::kDegenerate:
      return "degenerate";
  }
  return "unknown";
}

AbsolutePose estimate_absolute_pose(const Camera& camera,
                                    std::span<const Eigen::Vector2d> pixels,
                                    std::span<const Eigen::Vector3d> points_in_world,
                                    const AbsolutePoseOptions& options) {
  TM_CHECK(pixels.size() == points_in_world.size());
  RandomGenerator random(options.seed);
  const Rays rays = pose_search::rays_of(camera, pixels);
  AbsolutePose nothing{.inliers = InlierMask(pixels.size(), 0)};
  if (rays.match.size() < kMinPoints) {
    return nothing;
  }
  const Matches matches(pixels, points_in_world, random);
  const auto drawable = static_cast<std::uint32_t>(rays.match.size());
  Candidate best;
  bool solved_any = false;
  std::size_t needed = options.max_iterations;
  std::size_t iteration = 0;
  for (; iteration < needed; ++iteration) {
    const auto sample = sample_distinct<kSampleSize>(random, drawable);
    const P3pSolutions poses = pose_search::poses_of_sample(rays, points_in_world, sample);
    solved_any = solved_any || poses.count > 0;
    for (std::size_t k = 0; k < poses.count; ++k) {
      const PosedCamera posed{camera, poses.cam_from_world.at(k)};
      const Score score = matches.score(posed, options.max_error_px, best.score);
      if (!(score.cost < best.score.cost)) {
        continue;
      }
      best = pose_search::improve(
          matches, posed, {options.max_error_px, options.max_error_px, PoseUnknowns::kPose});
      needed = required_iterations(
          static_cast<double>(best.score.inliers) / static_cast<double>(pixels.size()),
          kSampleSize,
          options.confidence,
          options.max_iterations);
    }
  }
  if (best.score.inliers == 0) {
    nothing.outcome =
        solved_any ? AbsolutePoseOutcome::kTooFewInliers : AbsolutePoseOutcome::kDegenerate;
    nothing.iterations = iteration;
    return nothing;
  }
  AbsolutePose out = pose_search::report(matches, best, options);
  out.iterations = iteration;
  return out;
}

AbsolutePose refine_absolute_pose(const Camera& camera,
                                  std::span<const Eigen::Vector2d> pixels,
                                  std::span<const Eigen::Vector3d> points_in_world,
                                  const Rigid3& start_cam_from_world,
                                  const AbsolutePoseOptions& options) {
  TM_CHECK(pixels.size() == points_in_world.size());
  if (pixels.size() < kMinPoints) {
    return {.inliers = InlierMask(pixels.size(), 0)};
  }
  constexpr double kStartReach = 3.0;
  RandomGenerator random(options.seed);
  const Matches matches(pixels, points_in_world, random);
  const Candidate best = pose_search::improve(
      matches,
      {camera, start_cam_from_world},
      {kStartReach * options.max_error_px, options.max_error_px, PoseUnknowns::kPose});
  return pose_search::report(matches, best, options);
}

}  // namespace trigmesh
