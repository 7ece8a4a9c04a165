#include "sfm/geometry/pose_search.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trigmesh::pose_search {

namespace {

/// Scale of the Cauchy loss as part of the inlier threshold.
constexpr double kLossRatio = 0.25;

}  // namespace

Matches::Matches(std::span<const Eigen::Vector2d> pixels,
                 std::span<const Eigen::Vector3d> points_in_world,
                 RandomGenerator& random)
    : pixels_(pixels),
      points_(points_in_world),
      order_(random_permutation(random, static_cast<std::uint32_t>(pixels.size()))) {}

double Matches::squared_error(const PosedCamera& posed,
                              const Eigen::Matrix3d& rotation,
                              std::size_t i) const {
  const auto pixel =
      project(posed.camera, rotation * points_[i] + posed.cam_from_world.translation);
  return pixel ? (*pixel - pixels_[i]).squaredNorm() : std::numeric_limits<double>::infinity();
}

Score Matches::score(const PosedCamera& posed, double max_error_px, const Score& best) const {
  const Eigen::Matrix3d rotation = posed.cam_from_world.rotation.toRotationMatrix();
  return score_sequentially(
      order_, max_error_px, best, [&](std::size_t i) { return squared_error(posed, rotation, i); });
}

Score Matches::mark(const PosedCamera& posed,
                    double max_error_px,
                    std::span<std::uint8_t> mask) const {
  const Eigen::Matrix3d rotation = posed.cam_from_world.rotation.toRotationMatrix();
  return mark_inliers(
      mask, max_error_px, [&](std::size_t i) { return squared_error(posed, rotation, i); });
}

Candidate improve(const Matches& matches, const PosedCamera& start, const ImproveOptions& options) {
  constexpr int kRounds = 4;
  constexpr int kSteps = 8;
  InlierMask mask(matches.size(), 0);
  Candidate best{.posed = start};
  best.score = matches.mark(start, options.max_error_px, mask);
  PosedCamera at = start;
  double error_px = options.first_error_px;
  for (int round = 0; round < kRounds; ++round) {
    if (matches.mark(at, error_px, mask).inliers < kMinPoints) {
      break;
    }
    const PoseRefinement refined = refine_pose(at,
                                               matches.pixels(),
                                               matches.points_in_world(),
                                               mask,
                                               kLossRatio * error_px,
                                               options.unknowns,
                                               kSteps);
    if (!refined.usable) {
      break;
    }
    const bool narrowing = error_px > options.max_error_px;
    error_px = std::max(options.max_error_px, 0.5 * error_px);
    const Score score = matches.mark(refined.result, options.max_error_px, mask);
    at = refined.result;
    constexpr double kWorthwhile = 1e-4;
    const bool better = score.cost < best.score.cost;
    const bool much_better = score.cost < (1.0 - kWorthwhile) * best.score.cost;
    if (better || round == 0) {
      best.determined = refined.determined;
      best.focal_sigma_per_px = refined.focal_sigma_per_px;
    }
    if (better) {
      best.posed = refined.result;
      best.score = score;
    }
    if (!much_better && !narrowing) {
      break;
    }
  }
  return best;
}

AbsolutePose report(const Matches& matches,
                    const Candidate& best,
                    const AbsolutePoseOptions& options) {
  AbsolutePose out;
  out.inliers.assign(matches.size(), 0);
  out.cam_from_world = best.posed.cam_from_world;
  const Score score = matches.mark(best.posed, options.max_error_px, out.inliers);
  out.inlier_count = score.inliers;
  if (score.inliers > 0) {
    const double outliers = static_cast<double>(matches.size() - score.inliers);
    const double squares = score.cost - outliers * options.max_error_px * options.max_error_px;
    out.rmse_px = std::sqrt(std::max(0.0, squares) / static_cast<double>(score.inliers));
  }
  if (score.inliers < options.min_inliers) {
    out.outcome = AbsolutePoseOutcome::kTooFewInliers;
  } else if (!best.determined) {
    out.outcome = AbsolutePoseOutcome::kDegenerate;
  } else {
    out.outcome = AbsolutePoseOutcome::kOk;
  }
  return out;
}

Rays rays_of(const Camera& camera, std::span<const Eigen::Vector2d> pixels) {
  Rays rays;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (const auto uv = normalize_pixel(camera, pixels[i])) {
      rays.match.push_back(static_cast<std::uint32_t>(i));
      rays.in_cam.push_back(Eigen::Vector3d(uv->x(), uv->y(), 1.0).normalized());
    }
  }
  return rays;
}

P3pSolutions poses_of_sample(const Rays& rays,
                             std::span<const Eigen::Vector3d> points_in_world,
                             const std::array<std::uint32_t, kSampleSize>& sample) {
  std::array<Eigen::Vector3d, kSampleSize> sample_rays;
  std::array<Eigen::Vector3d, kSampleSize> sample_points;
  for (std::size_t k = 0; k < kSampleSize; ++k) {
    sample_rays.at(k) = rays.in_cam[sample.at(k)];
    sample_points.at(k) = points_in_world[rays.match[sample.at(k)]];
  }
  return solve_p3p(sample_rays, sample_points);
}

}  // namespace trigmesh::pose_search
