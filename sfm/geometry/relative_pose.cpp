// Relative pose of two calibrated cameras: samples of five matches (five_point.hpp), truncated
// Sampson errors in undistorted pixels of F = K2^-T E K1^-1, each promising E improved as a pose
// (R, t) on its inliers before it is compared (LO-RANSAC: O. Chum, J. Matas, J. Kittler, DAGM
// 2003), the decomposition chosen by the matches in front of both cameras.
//
// Whether there was a translation at all: the best rotation between the rays, max tr(R^T sum q p^T)
// = U diag(1, 1, +-1) V^T (K. S. Arun, T. S. Huang, S. D. Blostein, PAMI 1987), must not explain
// nearly all inliers.
#include "sfm/geometry/relative_pose.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>

#include "firmware/base/check.hpp"
#include "sfm/geometry/epipolar.hpp"
#include "sfm/geometry/essential.hpp"
#include "sfm/geometry/five_point.hpp"
#include "sfm/geometry/homography.hpp"
#include "sfm/geometry/robust_score.hpp"

namespace trigmesh {

namespace {

constexpr std::size_t kSampleSize = 5;
constexpr std::size_t kMinMatches =
    6;  // five give up to ten matrices and nothing to choose between them
/// Scale of the Cauchy loss as part of the inlier threshold.
constexpr double kLossRatio = 0.5;

/// The matches whose pixels have rays, in the three forms that the steps need.
struct Matches {
  std::vector<std::uint32_t> position;               ///< in the caller's list
  std::vector<Eigen::Vector2d> first, second;        ///< normalised coordinates
  std::vector<Eigen::Vector2d> first_px, second_px;  ///< undistorted pixels
  CalibrationPair calibrations;

  [[nodiscard]] std::size_t size() const { return position.size(); }
};

Eigen::Vector2d undistorted(const Eigen::Matrix3d& calibration, const Eigen::Vector2d& uv) {
  return calibration.topLeftCorner<2, 2>() * uv + calibration.topRightCorner<2, 1>();
}

Matches prepare(const Camera& first_camera,
                const Camera& second_camera,
                std::span<const Eigen::Vector2d> first_pixels,
                std::span<const Eigen::Vector2d> second_pixels) {
  Matches matches;
  matches.calibrations = {first_camera.calibration_matrix(), second_camera.calibration_matrix()};
  for (std::size_t i = 0; i < first_pixels.size(); ++i) {
    const auto first = normalize_pixel(first_camera, first_pixels[i]);
    const auto second = normalize_pixel(second_camera, second_pixels[i]);
    if (first && second) {
      matches.position.push_back(static_cast<std::uint32_t>(i));
      matches.first.push_back(*first);
      matches.second.push_back(*second);
      matches.first_px.push_back(undistorted(matches.calibrations.first, *first));
      matches.second_px.push_back(undistorted(matches.calibrations.second, *second));
    }
  }
  return matches;
}

/// Squared Sampson error in pixels of a match, for one essential matrix.
class PixelError {
 public:
  PixelError(const Matches& matches, const Eigen::Matrix3d& essential)
      : matches_(matches),
        fundamental_(fundamental_from_essential(
            essential, matches.calibrations.first, matches.calibrations.second)) {}

  double operator()(std::size_t i) const {
    return sampson_error_squared(fundamental_, matches_.first_px[i], matches_.second_px[i]);
  }

 private:
  const Matches& matches_;
  Eigen::Matrix3d fundamental_;
};

/// A pose, of which only the essential matrix counts so far, with how well it does.
struct Candidate {
  Rigid3 second_from_first;
  Score score{};
};

/// Fits to the inliers and looks again who they are, as long as the cost falls. Begins with those
/// within twice the limit: a sample of five noisy matches leaves many right ones just outside of
/// it.
Candidate improve(const Matches& matches, const Eigen::Matrix3d& essential, double max_error_px) {
  constexpr int kRounds = 4;
  constexpr int kSteps = 10;
  constexpr double kWorthwhile = 1e-4;
  constexpr double kWide = 2.0;
  Candidate best{.second_from_first = decompose_essential(essential)[0]};
  InlierMask mask(matches.size(), 0);
  best.score = mark_inliers(mask, max_error_px, PixelError(matches, essential));
  (void)mark_inliers(
      mask, kWide * max_error_px, PixelError(matches, essential));  // for the mask alone
  for (int round = 0; round < kRounds && best.score.inliers >= kMinMatches; ++round) {
    const Rigid3 refined =
        refine_relative_pose(best.second_from_first,
                             matches.calibrations,
                             matches.first_px,
                             matches.second_px,
                             mask,
                             {.loss_scale = kLossRatio * max_error_px, .max_iterations = kSteps});
    const Score score =
        mark_inliers(mask, max_error_px, PixelError(matches, essential_from_pose(refined)));
    const double before = best.score.cost;
    if (!(score.cost < before)) {
      break;
    }
    best = {refined, score};
    if (score.cost > (1.0 - kWorthwhile) * before) {
      break;
    }
  }
  return best;
}

/// The best rotation between the rays of the matches in `mask`.
Eigen::Quaterniond fit_rotation(const Matches& matches, const InlierMask& mask) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (mask[i] != 0) {
      sum += Eigen::Vector3d(matches.second[i].homogeneous()).normalized() *
             Eigen::Vector3d(matches.first[i].homogeneous()).normalized().transpose();
    }
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double handed =
      svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0 ? -1.0 : 1.0;
  const Eigen::Matrix3d rotation =
      svd.matrixU() * Eigen::Vector3d(1.0, 1.0, handed).asDiagonal() * svd.matrixV().transpose();
  return Eigen::Quaterniond(rotation).normalized();
}

/// How many of the inliers a rotation explains; refines it on these.
struct RotationFit {
  Eigen::Quaterniond second_from_first;
  std::size_t inliers = 0;
};

RotationFit explain_by_rotation(const Matches& matches,
                                const InlierMask& inliers,
                                double max_error_px) {
  constexpr int kRounds = 3;
  // A distance in two coordinates of one image, where the Sampson error is one coordinate shared by
  // two images.
  const double limit = 2.0 * max_error_px;
  InlierMask mask = inliers;
  RotationFit fit;
  for (int round = 0; round < kRounds; ++round) {
    fit.second_from_first = fit_rotation(matches, mask);
    fit.inliers = 0;
    for (std::size_t i = 0; i < matches.size(); ++i) {
      const Eigen::Vector3d ray =
          fit.second_from_first * Eigen::Vector3d(matches.first[i].homogeneous());
      const bool agrees =
          inliers[i] != 0 && ray.z() > 0.0 &&
          (undistorted(matches.calibrations.second, ray.hnormalized()) - matches.second_px[i])
                  .norm() <= limit;
      mask[i] = agrees ? 1 : 0;
      fit.inliers += mask[i];
    }
    if (fit.inliers < 3) {
      break;
    }
  }
  return fit;
}

/// Takes out the matches that meet behind a camera and are far enough from parallel to be sure.
void drop_behind(const Matches& matches,
                 const Rigid3& pose,
                 double min_angle_rad,
                 InlierMask& mask) {
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const TwoViewDepths depths = two_view_depths(pose, matches.first[i], matches.second[i]);
    if (depths.angle_rad > min_angle_rad && !(depths.first > 0.0 && depths.second > 0.0)) {
      mask[i] = 0;
    }
  }
}

/// Fills counts, angle and errors from the final mask, and moves the mask to the caller's
/// positions.
void summarize(const Matches& matches, const InlierMask& mask, RelativePose& out) {
  const PixelError error(matches, essential_from_pose(out.second_from_first));
  std::vector<double> angles;
  double squares = 0.0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (mask[i] != 0) {
      out.inliers[matches.position[i]] = 1;
      angles.push_back(
          two_view_depths(out.second_from_first, matches.first[i], matches.second[i]).angle_rad);
      squares += error(i);
    }
  }
  out.inlier_count = angles.size();
  if (!angles.empty()) {
    const auto middle = angles.begin() + static_cast<std::ptrdiff_t>(angles.size() / 2);
    std::nth_element(angles.begin(), middle, angles.end());
    out.median_angle_rad = *middle;
    out.rmse_px = std::sqrt(squares / static_cast<double>(angles.size()));
  }
}

/// From the best essential matrix to the answer: inliers, parallax, choice of the decomposition.
RelativePose conclude(const Matches& matches,
                      const Candidate& best,
                      std::size_t caller_size,
                      const RelativePoseOptions& options) {
  // Of the inliers less than this part may need a translation by chance.
  constexpr double kParallaxRatio = 0.05;
  RelativePose out;
  out.inliers.assign(caller_size, 0);
  out.second_from_first = best.second_from_first;
  InlierMask mask(matches.size(), 0);
  const Eigen::Matrix3d essential = essential_from_pose(best.second_from_first);
  const Score score = mark_inliers(mask, options.max_error_px, PixelError(matches, essential));
  if (score.inliers < options.min_inliers) {
    summarize(matches, mask, out);
    out.outcome = RelativePoseOutcome::kTooFewInliers;
    return out;
  }
  const RotationFit rotation = explain_by_rotation(matches, mask, options.max_error_px);
  out.rotation_inlier_count = rotation.inliers;
  const double needed = std::max(static_cast<double>(kMinMatches),
                                 kParallaxRatio * static_cast<double>(score.inliers));
  if (static_cast<double>(score.inliers - rotation.inliers) < needed) {
    summarize(matches, mask, out);
    out.outcome = RelativePoseOutcome::kNoParallax;
    out.second_from_first = {rotation.second_from_first, Eigen::Vector3d::Zero()};
    return out;
  }
  const double focal_px = std::min(matches.calibrations.first.diagonal().head<2>().minCoeff(),
                                   matches.calibrations.second.diagonal().head<2>().minCoeff());
  const double min_angle_rad = 2.0 * options.max_error_px / focal_px;
  const PoseChoice choice =
      choose_pose(essential, matches.first, matches.second, mask, {.min_angle_rad = min_angle_rad});
  if (choice.in_front > 0) {
    out.second_from_first = choice.second_from_first;
  }
  if (choice.outcome == CheiralityOutcome::kOk) {
    drop_behind(matches, choice.second_from_first, min_angle_rad, mask);
    out.outcome = RelativePoseOutcome::kOk;
  } else {
    out.outcome = RelativePoseOutcome::kAmbiguous;
  }
  summarize(matches, mask, out);
  if (out.inlier_count < options.min_inliers) {
    out.outcome = RelativePoseOutcome::kTooFewInliers;
  }
  return out;
}

/// The other motion of the plane on which the inliers lie, improved on them; nothing when they lie
/// on none.
std::optional<Candidate> plane_twin(const Matches& matches,
                                    const Candidate& best,
                                    double max_error_px) {
  InlierMask mask(matches.size(), 0);
  const PixelError error(matches, essential_from_pose(best.second_from_first));
  const Score score = mark_inliers(mask, max_error_px, error);
  const HomographyEstimate plane = estimate_homography(matches.first, matches.second, mask);
  if (score.inliers < kMinMatches || plane.outcome != HomographyOutcome::kOk) {
    return std::nullopt;
  }
  const auto twin = other_motion_of_plane(plane.second_from_first, best.second_from_first);
  return twin ? std::optional(improve(matches, essential_from_pose(*twin), max_error_px))
              : std::nullopt;
}

/// The epipolar error cannot tell the two motions of a plane apart. Where the better one by error
/// leaves matches behind a camera, the other one is tried, and the one with more in front wins.
RelativePose conclude_with_twin(const Matches& matches,
                                const Candidate& best,
                                std::size_t caller_size,
                                const RelativePoseOptions& options) {
  constexpr double kNearlyAll = 0.98;
  RelativePose out = conclude(matches, best, caller_size, options);
  const bool left_behind =
      static_cast<double>(out.inlier_count) < kNearlyAll * static_cast<double>(best.score.inliers);
  if (out.outcome == RelativePoseOutcome::kNoParallax || !left_behind) {
    return out;
  }
  if (const auto twin = plane_twin(matches, best, options.max_error_px)) {
    RelativePose other = conclude(matches, *twin, caller_size, options);
    if (other.outcome == RelativePoseOutcome::kOk && other.inlier_count > out.inlier_count) {
      return other;
    }
  }
  return out;
}

FivePointSolutions essentials_of_sample(const Matches& matches,
                                        const std::array<std::uint32_t, kSampleSize>& sample) {
  std::array<Eigen::Vector3d, kSampleSize> first;
  std::array<Eigen::Vector3d, kSampleSize> second;
  for (std::size_t k = 0; k < kSampleSize; ++k) {
    first.at(k) = matches.first[sample.at(k)].homogeneous();
    second.at(k) = matches.second[sample.at(k)].homogeneous();
  }
  return solve_five_point(first, second);
}

}  // namespace

Result<> RelativePoseOptions::validate() const {
  if (!(max_error_px > 0.0)) {
    return fail(ErrorCode::kInvalidArgument,
                "relative pose max_error_px is {}, must be positive",
                max_error_px);
  }
  if (min_inliers < kMinMatches) {
    return fail(ErrorCode::kInvalidArgument,
                "relative pose min_inliers is {}, must be at least {}",
                min_inliers,
                kMinMatches);
  }
  if (!(confidence > 0.0 && confidence < 1.0)) {
    return fail(ErrorCode::kInvalidArgument,
                "relative pose confidence is {}, must be in (0, 1)",
                confidence);
  }
  if (max_iterations == 0) {
    return fail(ErrorCode::kInvalidArgument, "relative pose max_iterations is 0");
  }
  return {};
}

std::string_view to_string(RelativePoseOutcome outcome) {
  switch (outcome) {
    case RelativePoseOutcome::kOk:
      return "ok";
    case RelativePoseOutcome::kTooFewPoints:
      return "too_few_points";
    case RelativePoseOutcome::kTooFewInliers:
      return "too_few_inliers";
    case RelativePoseOutcome::kNoParallax:
      return "no_parallax";
    case RelativePoseOutcome::kAmbiguous:
      return "ambiguous";
  }
  return "unknown";
}

RelativePose estimate_relative_pose(const Camera& first_camera,
                                    const Camera& second_camera,
                                    std::span<const Eigen::Vector2d> first_pixels,
                                    std::span<const Eigen::Vector2d> second_pixels,
                                    const RelativePoseOptions& options) {
  TM_CHECK(first_pixels.size() == second_pixels.size());
  const Matches matches = prepare(first_camera, second_camera, first_pixels, second_pixels);
  if (matches.size() < kMinMatches) {
    return {.inliers = InlierMask(first_pixels.size(), 0)};
  }
  const auto count = static_cast<std::uint32_t>(matches.size());
  RandomGenerator random(options.seed);
  const std::vector<std::uint32_t> order = random_permutation(random, count);
  Candidate best;
  std::size_t needed = options.max_iterations;
  std::size_t iteration = 0;
  for (; iteration < needed; ++iteration) {
    const FivePointSolutions solutions =
        essentials_of_sample(matches, sample_distinct<kSampleSize>(random, count));
    for (std::size_t k = 0; k < solutions.count; ++k) {
      const Eigen::Matrix3d& essential = solutions.essentials.at(k);
      const Score score = score_sequentially(
          order, options.max_error_px, best.score, PixelError(matches, essential));
      if (!(score.cost < best.score.cost)) {
        continue;
      }
      best = improve(matches, essential, options.max_error_px);
      needed = required_iterations(static_cast<double>(best.score.inliers) / count,
                                   kSampleSize,
                                   options.confidence,
                                   options.max_iterations);
    }
  }
  RelativePose out = conclude_with_twin(matches, best, first_pixels.size(), options);
  out.iterations = iteration;
  return out;
}

RelativePose relative_pose_from_fundamental(const Eigen::Matrix3d& fundamental,
                                            const Camera& first_camera,
                                            const Camera& second_camera,
                                            std::span<const Eigen::Vector2d> first_pixels,
                                            std::span<const Eigen::Vector2d> second_pixels,
                                            const RelativePoseOptions& options) {
  TM_CHECK(first_pixels.size() == second_pixels.size());
  const Matches matches = prepare(first_camera, second_camera, first_pixels, second_pixels);
  if (matches.size() < kMinMatches || !fundamental.allFinite()) {
    return {.inliers = InlierMask(first_pixels.size(), 0)};
  }
  const Eigen::Matrix3d essential = enforce_essential(essential_from_fundamental(
      fundamental, matches.calibrations.first, matches.calibrations.second));
  return conclude_with_twin(
      matches, improve(matches, essential, options.max_error_px), first_pixels.size(), options);
}

}  // namespace trigmesh
