// Scoring stops early by Wald's sequential test: with e the part of inliers of a good pose and d
// that of a wrong one, the ratio of likelihoods of "wrong" to "good" is multiplied by d / e at each
// inlier and (1 - d) / (1 - e) at each outlier; the pose is given up when it exceeds a limit A,
// which loses a good one with probability 1 / A (J. Matas, O. Chum, "Randomized RANSAC with
// Sequential Probability Ratio Test", ICCV 2005, equation 2).
#include "sfm/geometry/pose_search.hpp"

#include <algorithm>
#include <cmath>

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
  constexpr double kChance = 0.02;        // part of the matches that agrees with a wrong pose
  constexpr double kLeastInliers = 0.08;  // the test stays patient at high outlier rates
  constexpr double kDecision = 200.0;     // one right pose in so many is lost
  const double expected =
      std::max(kLeastInliers, static_cast<double>(best.inliers) / static_cast<double>(size()));
  const double inlier_factor = kChance / expected;
  const double outlier_factor = (1.0 - kChance) / (1.0 - std::min(expected, 0.95));
  const double limit = max_error_px * max_error_px;
  const Eigen::Matrix3d rotation = posed.cam_from_world.rotation.toRotationMatrix();
  Score out{.cost = 0.0};
  double likelihood_ratio = 1.0;
  for (const std::uint32_t i : order_) {
    const double error = squared_error(posed, rotation, i);
    const bool inlier = error <= limit;
    out.cost += inlier ? error : limit;
    out.inliers += inlier ? 1 : 0;
    likelihood_ratio *= inlier ? inlier_factor : outlier_factor;
    if (out.cost >= best.cost || likelihood_ratio > kDecision) {
      return {};
    }
  }
  return out;
}

Score Matches::mark(const PosedCamera& posed,
                    double max_error_px,
                    std::span<std::uint8_t> mask) const {
  const double limit = max_error_px * max_error_px;
  const Eigen::Matrix3d rotation = posed.cam_from_world.rotation.toRotationMatrix();
  Score out{.cost = 0.0};
  for (std::size_t i = 0; i < size(); ++i) {
    const double error = squared_error(posed, rotation, i);
    mask[i] = error <= limit ? 1 : 0;
    out.inliers += mask[i];
    out.cost += std::min(error, limit);
  }
  return out;
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
