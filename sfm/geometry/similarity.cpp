// Similarity between two point sets: minimise sum_i | b_i - (s R a_i + t) |^2.
//
//   Sigma = 1/n sum (b_i - mean_b)(a_i - mean_a)^T = U D V^T
//   R = U S V^T,  s = tr(D S) / var_a,  t = mean_b - s R mean_a,  S = diag(1, 1, det(U) det(V))
//
// S. Umeyama, "Least-squares estimation of transformation parameters between two point patterns",
// PAMI 1991, equations 34 to 43. Unique when Sigma has rank two or more.
#include "sfm/geometry/similarity.hpp"

#include <array>
#include <cmath>
#include <vector>

#include <Eigen/LU>
#include <Eigen/SVD>

#include "firmware/base/check.hpp"

namespace trigmesh {

namespace {

/// Second singular value below this part of the first: the points are on a line as far as doubles
/// can tell.
constexpr double kCollinearRatio = 1e-10;

struct Moments {
  Eigen::Vector3d mean_a = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_b = Eigen::Vector3d::Zero();
  Eigen::Matrix3d sigma = Eigen::Matrix3d::Zero();  ///< covariance of b with a
  double variance_a = 0.0;
};

Moments moments_of(std::span<const Eigen::Vector3d> a, std::span<const Eigen::Vector3d> b) {
  Moments m;
  const double n = static_cast<double>(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    m.mean_a += a[i];
    m.mean_b += b[i];
  }
  m.mean_a /= n;
  m.mean_b /= n;
  for (std::size_t i = 0; i < a.size(); ++i) {
    m.sigma += (b[i] - m.mean_b) * (a[i] - m.mean_a).transpose();
    m.variance_a += (a[i] - m.mean_a).squaredNorm();
  }
  m.sigma /= n;
  m.variance_a /= n;
  return m;
}

double score(const Sim3& b_from_a,
             std::span<const Eigen::Vector3d> a,
             std::span<const Eigen::Vector3d> b,
             double max_error) {
  const double limit = max_error * max_error;
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    sum += std::min(limit, (b_from_a * a[i] - b[i]).squaredNorm());
  }
  return sum;
}

/// Fits to the pairs within `max_error` of the given motion.
Alignment refit(const Sim3& b_from_a,
                std::span<const Eigen::Vector3d> a,
                std::span<const Eigen::Vector3d> b,
                const RobustAlignmentOptions& options) {
  std::vector<Eigen::Vector3d> inliers_a;
  std::vector<Eigen::Vector3d> inliers_b;
  InlierMask mask(a.size(), 0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    if ((b_from_a * a[i] - b[i]).norm() <= options.max_error) {
      mask[i] = 1;
      inliers_a.push_back(a[i]);
      inliers_b.push_back(b[i]);
    }
  }
  Alignment fit = align_points(inliers_a, inliers_b, options.scale_mode);
  fit.inliers = std::move(mask);
  fit.inlier_count = inliers_a.size();
  return fit;
}

}  // namespace

Rigid3 transform_pose(const Sim3& b_from_a, const Rigid3& cam_from_a) {
  const Eigen::Quaterniond rotation =
      (cam_from_a.rotation * b_from_a.rotation.conjugate()).normalized();
  return {rotation, -(rotation * (b_from_a * camera_center(cam_from_a)))};
}

Alignment align_points(std::span<const Eigen::Vector3d> points_in_a,
                       std::span<const Eigen::Vector3d> points_in_b,
                       ScaleMode scale_mode) {
  TM_CHECK(points_in_a.size() == points_in_b.size());
  Alignment result;
  if (points_in_a.size() < 3) {
    return result;
  }
  const Moments m = moments_of(points_in_a, points_in_b);
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m.sigma, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d& d = svd.singularValues();
  if (!(d[0] > 0.0) || d[1] <= kCollinearRatio * d[0]) {
    result.outcome = AlignmentOutcome::kDegenerate;
    return result;
  }
  const double handed =
      svd.matrixU().determinant() * svd.matrixV().determinant() < 0.0 ? -1.0 : 1.0;
  const Eigen::Vector3d s(1.0, 1.0, handed);
  const Eigen::Matrix3d rotation = svd.matrixU() * s.asDiagonal() * svd.matrixV().transpose();
  result.b_from_a.rotation = Eigen::Quaterniond(rotation).normalized();
  result.b_from_a.scale = scale_mode == ScaleMode::kEstimated ? d.dot(s) / m.variance_a : 1.0;
  if (!(result.b_from_a.scale > 0.0) || !std::isfinite(result.b_from_a.scale)) {
    result.outcome = AlignmentOutcome::kDegenerate;
    return result;
  }
  result.b_from_a.translation =
      m.mean_b - result.b_from_a.scale * (result.b_from_a.rotation * m.mean_a);
  double sum = 0.0;
  for (std::size_t i = 0; i < points_in_a.size(); ++i) {
    sum += (result.b_from_a * points_in_a[i] - points_in_b[i]).squaredNorm();
  }
  result.rmse = std::sqrt(sum / static_cast<double>(points_in_a.size()));
  result.outcome = AlignmentOutcome::kOk;
  return result;
}

Alignment align_points_robust(std::span<const Eigen::Vector3d> points_in_a,
                              std::span<const Eigen::Vector3d> points_in_b,
                              const RobustAlignmentOptions& options) {
  TM_CHECK(points_in_a.size() == points_in_b.size());
  TM_CHECK(options.max_error > 0.0);
  Alignment best;
  if (points_in_a.size() < 3) {
    return best;
  }
  best.outcome = AlignmentOutcome::kDegenerate;
  double best_score = 0.0;
  const auto count = static_cast<std::uint32_t>(points_in_a.size());
  RandomGenerator random(options.seed);
  std::size_t needed = options.max_iterations;
  const auto consider = [&](Alignment candidate) {
    if (candidate.outcome != AlignmentOutcome::kOk) {
      return false;
    }
    const double value = score(candidate.b_from_a, points_in_a, points_in_b, options.max_error);
    if (best.outcome == AlignmentOutcome::kOk && value >= best_score) {
      return false;
    }
    best_score = value;
    best = std::move(candidate);
    return true;
  };
  for (std::size_t i = 0; i < needed; ++i) {
    const auto sample = sample_distinct<3>(random, count);
    std::array<Eigen::Vector3d, 3> a;
    std::array<Eigen::Vector3d, 3> b;
    for (std::size_t k = 0; k < 3; ++k) {
      a[k] = points_in_a[sample[k]];
      b[k] = points_in_b[sample[k]];
    }
    if (!consider(align_points(a, b, options.scale_mode))) {
      continue;
    }
    while (consider(refit(best.b_from_a, points_in_a, points_in_b, options))) {
    }
    const Alignment counted = refit(best.b_from_a, points_in_a, points_in_b, options);
    needed = required_iterations(static_cast<double>(counted.inlier_count) / count,
                                 3,
                                 options.confidence,
                                 options.max_iterations);
  }
  if (best.outcome != AlignmentOutcome::kOk) {
    return best;
  }
  Alignment result = refit(best.b_from_a, points_in_a, points_in_b, options);
  if (result.outcome != AlignmentOutcome::kOk || result.inlier_count < options.min_inliers) {
    result.outcome = AlignmentOutcome::kTooFewInliers;
  }
  return result;
}

}  // namespace trigmesh
