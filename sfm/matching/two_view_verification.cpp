#include "sfm/matching/two_view_verification.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "firmware/base/check.hpp"
#include "sfm/matching/two_view_models.hpp"

namespace trigmesh {
namespace {

using internal::CalibrationPair;
using internal::PointPairs;
using internal::SearchLimits;

/// A homography that explains the wanted part of the matches is found in far fewer samples than
/// this.
constexpr int kHomographyIterations = 100;
constexpr std::size_t kHomographySamples = 300;
/// Rotations are fitted to at most this many pairs.
constexpr std::size_t kRotationSamples = 200;
/// Focal lengths tried when none is known, in parts of the longer side: 130 to 20 degrees of view;
/// then refined between them.
constexpr std::array kFocalRatios = {0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8};
constexpr double kFocalRatioStep = 1.42;
constexpr int kFocalRefinements = 14;
/// While the focal length is wrong, errors up to this many times the limit still say how wrong.
constexpr double kFocalSearchErrors = 10.0;

/// The matches of one call with finite points, and where they come from.
struct Candidates {
  PointPairs pairs;
  std::vector<FeatureMatch> matches;
};

Candidates gather(std::span<const FeatureMatch> matches,
                  const VerificationImage& first,
                  const VerificationImage& second) {
  Candidates out;
  out.matches.reserve(matches.size());
  out.pairs.first.reserve(matches.size());
  out.pairs.second.reserve(matches.size());
  for (const FeatureMatch& match : matches) {
    TM_CHECK(index(match.first) < first.points_px.size() &&
             index(match.second) < second.points_px.size());
    const Eigen::Vector2d& point_first = first.points_px[index(match.first)];
    const Eigen::Vector2d& point_second = second.points_px[index(match.second)];
    if (point_first.allFinite() && point_second.allFinite()) {
      out.matches.push_back(match);
      out.pairs.first.push_back(point_first);
      out.pairs.second.push_back(point_second);
    }
  }
  return out;
}

std::vector<FeatureMatch> select(const std::vector<FeatureMatch>& matches,
                                 const std::vector<std::size_t>& positions) {
  std::vector<FeatureMatch> out;
  out.reserve(positions.size());
  for (const std::size_t i : positions) {
    out.push_back(matches[i]);
  }
  std::sort(out.begin(), out.end());
  return out;
}

bool near_border(const Eigen::Vector2d& point,
                 const VerificationImage& image,
                 double border_ratio) {
  const double border = border_ratio * std::hypot(image.width_px, image.height_px);
  return point.x() < border || point.y() < border || point.x() > image.width_px - 1 - border ||
         point.y() > image.height_px - 1 - border;
}

/// Whether the matches stand still as an overlay or a second copy of the same picture would.
std::optional<TwoViewGeometry> standing_still(const Candidates& candidates,
                                              const VerificationImage& first,
                                              const VerificationImage& second,
                                              const VerificationOptions& options) {
  std::vector<std::size_t> still;
  std::size_t at_border = 0;
  for (std::size_t i = 0; i < candidates.pairs.size(); ++i) {
    if ((candidates.pairs.first[i] - candidates.pairs.second[i]).norm() <= options.max_still_px) {
      still.push_back(i);
      at_border += near_border(candidates.pairs.first[i], first, options.border_ratio) ? 1U : 0U;
    }
  }
  const auto share = [](std::size_t part, std::size_t all) {
    return static_cast<double>(part) / static_cast<double>(all);
  };
  if (still.size() < options.min_inliers ||
      share(still.size(), candidates.pairs.size()) < options.min_still_ratio) {
    return std::nullopt;
  }
  TwoViewGeometry out;
  out.inliers = select(candidates.matches, still);
  out.homography = Eigen::Matrix3d::Identity();
  out.homography_inliers = still.size();
  const std::size_t features = std::min(first.points_px.size(), second.points_px.size());
  if (share(still.size(), features) >= options.min_duplicate_ratio) {
    out.kind = TwoViewKind::kDuplicate;
    return out;
  }
  if (share(at_border, still.size()) >= options.min_still_ratio) {
    out.kind = TwoViewKind::kWatermark;
    return out;
  }
  return std::nullopt;
}

Eigen::Matrix3d calibration_or_guess(const VerificationImage& image, double focal_ratio) {
  if (image.calibration) {
    return *image.calibration;
  }
  Eigen::Matrix3d k = Eigen::Matrix3d::Identity();
  k(0, 0) = k(1, 1) = focal_ratio * std::max(image.width_px, image.height_px);
  k(0, 2) = 0.5 * (image.width_px - 1);
  k(1, 2) = 0.5 * (image.height_px - 1);
  return k;
}

/// The focal length, in parts of the longer side, with which a rotation explains the pairs best.
double search_focal_ratio(const PointPairs& pairs,
                          const VerificationImage& first,
                          const VerificationImage& second,
                          double max_error_px) {
  const double limit_px = kFocalSearchErrors * max_error_px;
  const auto cost = [&](double focal_ratio) {
    const CalibrationPair calibration{calibration_or_guess(first, focal_ratio),
                                      calibration_or_guess(second, focal_ratio)};
    const Eigen::Matrix3d homography =
        internal::fit_rotation_homography(pairs, calibration, limit_px);
    double sum = 0.0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      sum += std::min(internal::transfer_squared(homography, pairs.first[i], pairs.second[i]),
                      limit_px * limit_px);
    }
    return sum;
  };
  double best = kFocalRatios.front();
  double best_cost = cost(best);
  const auto try_ratio = [&](double ratio) {
    const double new_cost = cost(ratio);
    if (new_cost < best_cost) {
      best = ratio;
      best_cost = new_cost;
    }
  };
  for (const double ratio : kFocalRatios) {
    try_ratio(ratio);
  }
  double step = kFocalRatioStep;
  for (int i = 0; i < kFocalRefinements; i += 2) {
    step = std::sqrt(step);
    const double middle = best;
    try_ratio(middle * step);
    try_ratio(middle / step);
  }
  return best;
}

/// H = K2 R K1^-1 that explains most pairs, with the given calibration or the focal length that
/// suits them best.
Eigen::Matrix3d find_rotation_homography(const PointPairs& pairs,
                                         const VerificationImage& first,
                                         const VerificationImage& second,
                                         double max_error_px) {
  const PointPairs some = pairs.thinned(kRotationSamples);
  const bool known = first.calibration && second.calibration;
  const double focal_ratio = known ? 1.0 : search_focal_ratio(some, first, second, max_error_px);
  const CalibrationPair calibration{calibration_or_guess(first, focal_ratio),
                                    calibration_or_guess(second, focal_ratio)};
  return internal::fit_rotation_homography(some, calibration, max_error_px);
}

/// Whether the points fill an area, in both images: points on a line or in one place fit anything.
bool fills_area(const PointPairs& pairs,
                const std::vector<std::size_t>& positions,
                double least_spread_px) {
  for (const std::vector<Eigen::Vector2d>* points : {&pairs.first, &pairs.second}) {
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const std::size_t i : positions) {
      mean += (*points)[i] / static_cast<double>(positions.size());
    }
    Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
    for (const std::size_t i : positions) {
      const Eigen::Vector2d offset = (*points)[i] - mean;
      covariance += offset * offset.transpose() / static_cast<double>(positions.size());
    }
    const double half_trace = 0.5 * covariance.trace();
    const double smallest =
        half_trace - std::sqrt(std::max(0.0, half_trace * half_trace - covariance.determinant()));
    if (smallest < least_spread_px * least_spread_px) {
      return false;
    }
  }
  return true;
}

/// Part of `all` that `part` is.
bool reaches(std::size_t part, std::size_t all, double ratio) {
  return static_cast<double>(part) >= ratio * static_cast<double>(all);
}

/// F and H with what agrees with them.
struct Models {
  Eigen::Matrix3d fundamental = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d homography = Eigen::Matrix3d::Zero();
  std::vector<std::size_t> on_fundamental;
  std::vector<std::size_t> on_homography;
};

Models find_models(const PointPairs& pairs, const VerificationOptions& options) {
  Models out;
  SearchLimits limits{.max_error_px = options.max_error_px,
                      .max_iterations = options.max_iterations,
                      .seed = options.seed};
  if (const auto found =
          internal::search_fundamental(pairs.thinned(options.max_sampled_matches), limits)) {
    out.fundamental = internal::refine_fundamental(pairs, *found, options.max_error_px);
    out.on_fundamental =
        internal::fundamental_inliers(pairs, out.fundamental, options.max_error_px);
  }
  // The homography is sampled among what agrees with F, and counted over everything.
  limits.max_iterations = std::min(options.max_iterations, kHomographyIterations);
  const PointPairs consistent =
      out.on_fundamental.size() >= options.min_inliers ? pairs.selected(out.on_fundamental) : pairs;
  if (const auto found =
          internal::search_homography(consistent.thinned(kHomographySamples), limits)) {
    out.homography = internal::refine_homography(consistent, *found, options.max_error_px);
    out.on_homography = internal::homography_inliers(pairs, out.homography, options.max_error_px);
  }
  return out;
}

}  // namespace

Result<> VerificationOptions::validate() const {
  const auto positive_part = [](double value) { return value > 0.0 && value <= 1.0; };
  if (!(max_error_px > 0.0) || !std::isfinite(max_error_px)) {
    return fail(ErrorCode::kInvalidArgument, "max_error_px is {}, must be above 0", max_error_px);
  }
  if (min_inliers < 8) {
    return fail(ErrorCode::kInvalidArgument, "min_inliers is {}, must be at least 8", min_inliers);
  }
  if (!positive_part(min_homography_ratio) || !positive_part(min_rotation_ratio) ||
      !positive_part(min_still_ratio) || !positive_part(min_duplicate_ratio)) {
    return fail(ErrorCode::kInvalidArgument,
                "min_homography_ratio {}, min_rotation_ratio {}, min_still_ratio {} and "
                "min_duplicate_ratio {} must be in (0, 1]",
                min_homography_ratio,
                min_rotation_ratio,
                min_still_ratio,
                min_duplicate_ratio);
  }
  if (!(max_still_px >= 0.0)) {
    return fail(
        ErrorCode::kInvalidArgument, "max_still_px is {}, must not be negative", max_still_px);
  }
  if (!(border_ratio > 0.0 && border_ratio < 0.5)) {
    return fail(
        ErrorCode::kInvalidArgument, "border_ratio is {}, must be in (0, 0.5)", border_ratio);
  }
  if (max_sampled_matches < 50) {
    return fail(ErrorCode::kInvalidArgument,
                "max_sampled_matches is {}, must be at least 50",
                max_sampled_matches);
  }
  if (max_iterations <= 0) {
    return fail(
        ErrorCode::kInvalidArgument, "max_iterations is {}, must be above 0", max_iterations);
  }
  return {};
}

TwoViewGeometry verify_pair(std::span<const FeatureMatch> matches,
                            const VerificationImage& first,
                            const VerificationImage& second,
                            const VerificationOptions& options) {
  TwoViewGeometry none;
  none.candidates = matches.size();
  const Candidates candidates = gather(matches, first, second);
  const PointPairs& pairs = candidates.pairs;
  if (pairs.size() < options.min_inliers) {
    return none;
  }
  if (auto still = standing_still(candidates, first, second, options)) {
    still->candidates = matches.size();
    return *std::move(still);
  }

  const Models models = find_models(pairs, options);
  const bool has_fundamental = models.on_fundamental.size() >= options.min_inliers;
  std::vector<std::size_t> agreeing =
      has_fundamental ? models.on_fundamental : models.on_homography;
  if (agreeing.size() < options.min_inliers || !fills_area(pairs, agreeing, options.max_error_px)) {
    return none;
  }
  TwoViewGeometry out = none;
  out.kind = TwoViewKind::kGeneral;
  out.fundamental = has_fundamental ? models.fundamental : Eigen::Matrix3d::Zero();
  out.homography = models.homography;
  out.homography_inliers = models.on_homography.size();
  if (reaches(models.on_homography.size(), agreeing.size(), options.min_homography_ratio)) {
    out.kind = TwoViewKind::kPlanar;
    const Eigen::Matrix3d rotation = find_rotation_homography(
        pairs.selected(models.on_homography), first, second, options.max_error_px);
    auto turned = internal::homography_inliers(pairs, rotation, options.max_error_px);
    if (turned.size() >= options.min_inliers &&
        reaches(turned.size(), agreeing.size(), options.min_rotation_ratio)) {
      out.kind = TwoViewKind::kPureRotation;
      out.homography = rotation.normalized();
      out.homography_inliers = turned.size();
      agreeing = std::move(turned);
    }
  }
  out.inliers = select(candidates.matches, agreeing);
  return out;
}

}  // namespace trigmesh
