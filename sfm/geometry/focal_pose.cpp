// Pose and focal length together. P3P needs the focal length, so each sample of three is solved for
// every focal length of a logarithmic grid; a promising pose is refined with the focal length as a
// seventh unknown and judged by the same truncated cost as in absolute_pose.cpp. (A grid in place
// of a minimal solver: T. Sattler, C. Sweeney, M. Pollefeys, "On Sampling Focal Length Values to
// Solve the Absolute Pose Problem", ECCV 2014, section 3.)
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "firmware/base/check.hpp"
#include "sfm/geometry/absolute_pose.hpp"
#include "sfm/geometry/pose_search.hpp"

namespace trigmesh {

namespace {

using pose_search::Candidate;
using pose_search::kMinPoints;
using pose_search::kSampleSize;
using pose_search::Matches;
using pose_search::Rays;

/// One focal length of the grid, with the rays that it gives to the pixels.
struct GridCamera {
  Camera camera;
  Rays rays;
};

std::vector<GridCamera> grid_of(const Camera& camera,
                                std::span<const Eigen::Vector2d> pixels,
                                const FocalSearchOptions& search) {
  const double side_px = std::max(camera.width_px, camera.height_px);
  const double spread = search.max_focal_ratio / search.min_focal_ratio;
  std::vector<GridCamera> grid;
  for (int i = 0; i < search.candidates; ++i) {
    const double position = static_cast<double>(i) / (search.candidates - 1);
    Camera candidate = camera;
    candidate.fx_px = search.min_focal_ratio * std::pow(spread, position) * side_px;
    candidate.fy_px = candidate.fx_px * camera.fy_px / camera.fx_px;
    Rays rays = pose_search::rays_of(candidate, pixels);
    if (rays.match.size() >= kMinPoints) {
      grid.push_back({candidate, std::move(rays)});
    }
  }
  return grid;
}

/// Threshold for comparing unrefined poses. Between two candidates the focal length is off by up to
/// half a step; what the pose cannot make up of that must not turn inliers into outliers.
double coarse_error_px(const Camera& camera,
                       const AbsolutePoseOptions& options,
                       const FocalSearchOptions& search) {
  constexpr double kNotMadeUp = 0.15;
  const double spread = search.max_focal_ratio / search.min_focal_ratio;
  const double half_step = 0.5 * (std::pow(spread, 1.0 / (search.candidates - 1)) - 1.0);
  const double side_px = std::max(camera.width_px, camera.height_px);
  return std::max(options.max_error_px, kNotMadeUp * half_step * side_px);
}

/// The state of the search: the best unrefined score and the best refined candidate.
struct Search {
  Score best_coarse;
  Candidate best;
  bool solved_any = false;
  bool improved = false;  ///< by the last sample
};

/// Solves one sample for every camera of the grid.
void try_sample(const Matches& matches,
                const std::vector<GridCamera>& grid,
                std::uint64_t sample_seed,
                const pose_search::ImproveOptions& improving,
                Search& search) {
  search.improved = false;
  for (const GridCamera& entry : grid) {
    RandomGenerator random(sample_seed);
    const auto drawable = static_cast<std::uint32_t>(entry.rays.match.size());
    const auto sample = sample_distinct<kSampleSize>(random, drawable);
    const P3pSolutions poses =
        pose_search::poses_of_sample(entry.rays, matches.points_in_world(), sample);
    search.solved_any = search.solved_any || poses.count > 0;
    for (std::size_t k = 0; k < poses.count; ++k) {
      const PosedCamera posed{entry.camera, poses.cam_from_world.at(k)};
      const Score coarse = matches.score(posed, improving.first_error_px, search.best_coarse);
      if (!(coarse.cost < search.best_coarse.cost)) {
        continue;
      }
      search.best_coarse = coarse;
      const Candidate candidate = pose_search::improve(matches, posed, improving);
      if (candidate.score.cost < search.best.score.cost) {
        search.best = candidate;
        search.improved = true;
      }
    }
  }
}

}  // namespace

Result<> FocalSearchOptions::validate() const {
  if (!(min_focal_ratio > 0.0 && max_focal_ratio > min_focal_ratio &&
        std::isfinite(max_focal_ratio))) {
    return fail(ErrorCode::kInvalidArgument,
                "focal search range is [{}, {}], must be positive and rising",
                min_focal_ratio,
                max_focal_ratio);
  }
  if (candidates < 2) {
    return fail(ErrorCode::kInvalidArgument,
                "focal search candidates is {}, must be at least 2",
                candidates);
  }
  return {};
}

FocalPose estimate_focal_pose(const Camera& camera,
                              std::span<const Eigen::Vector2d> pixels,
                              std::span<const Eigen::Vector3d> points_in_world,
                              const AbsolutePoseOptions& options,
                              const FocalSearchOptions& search_options) {
  TM_CHECK(pixels.size() == points_in_world.size());
  TM_CHECK(search_options.candidates >= 2);
  FocalPose out;
  out.pose.inliers.assign(pixels.size(), 0);
  out.camera = camera;
  const std::vector<GridCamera> grid = grid_of(camera, pixels, search_options);
  if (grid.empty()) {
    return out;
  }
  RandomGenerator random(options.seed);
  const Matches matches(pixels, points_in_world, random);
  const pose_search::ImproveOptions improving{coarse_error_px(camera, options, search_options),
                                              options.max_error_px,
                                              PoseUnknowns::kPoseAndFocal};
  Search search;
  std::size_t needed = options.max_iterations;
  std::size_t iteration = 0;
  for (; iteration < needed; ++iteration) {
    try_sample(matches, grid, random.next(), improving, search);
    if (search.improved) {
      needed = required_iterations(
          static_cast<double>(search.best.score.inliers) / static_cast<double>(pixels.size()),
          kSampleSize,
          options.confidence,
          options.max_iterations);
    }
  }
  if (search.best.score.inliers == 0) {
    out.pose.outcome =
        search.solved_any ? AbsolutePoseOutcome::kTooFewInliers : AbsolutePoseOutcome::kDegenerate;
  } else {
    out.pose = pose_search::report(matches, search.best, options);
    out.camera = search.best.posed.camera;
    out.focal_relative_sigma = search.best.focal_sigma_per_px * out.pose.rmse_px;
  }
  out.pose.iterations = iteration;
  return out;
}

}  // namespace trigmesh
