#include "sfm/matching/two_view_models.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <opencv2/calib3d.hpp>

namespace trigmesh::internal {
namespace {

using Vector9d = Eigen::Matrix<double, 9, 1>;
using Matrix9d = Eigen::Matrix<double, 9, 9>;

constexpr int kRefinementRounds = 6;
/// Refinement ends when the score grows by less than this part.
constexpr double kLeastGain = 1e-3;

std::vector<cv::Point2d> to_opencv(const std::vector<Eigen::Vector2d>& points) {
  std::vector<cv::Point2d> out;
  out.reserve(points.size());
  for (const Eigen::Vector2d& point : points) {
    out.emplace_back(point.x(), point.y());
  }
  return out;
}

/// First 3x3 of what OpenCV returned, with unit norm; nothing when it returned no model.
std::optional<Eigen::Matrix3d> from_opencv(const cv::Mat& matrix) {
  if (matrix.rows < 3 || matrix.cols != 3 || matrix.type() != CV_64F) {
    return std::nullopt;
  }
  Eigen::Matrix3d out;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      out(row, column) = matrix.at<double>(row, column);
    }
  }
  if (!out.allFinite() || out.norm() == 0.0) {
    return std::nullopt;
  }
  return out.normalized();
}

cv::UsacParams usac_parameters(const SearchLimits& limits) {
  cv::UsacParams parameters;
  parameters.confidence = limits.confidence;
  parameters.isParallel = false;
  parameters.loIterations = 5;
  parameters.loMethod = cv::LOCAL_OPTIM_INNER_LO;
  parameters.loSampleSize = 14;
  parameters.maxIterations = limits.max_iterations;
  parameters.neighborsSearch = cv::NEIGH_GRID;
  parameters.randomGeneratorState = limits.seed;
  parameters.sampler = cv::SAMPLING_UNIFORM;
  parameters.score = cv::SCORE_METHOD_MSAC;
  parameters.threshold = limits.max_error_px;
  return parameters;
}

/// x_unit = (x - center) / scale, with one scale for both images so that residuals keep their
/// proportions.
struct Normalization {
  Eigen::Vector2d center_first = Eigen::Vector2d::Zero();
  Eigen::Vector2d center_second = Eigen::Vector2d::Zero();
  double scale_px = 1.0;

  explicit Normalization(const PointPairs& pairs) {
    const auto count = static_cast<double>(pairs.size());
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      center_first += pairs.first[i] / count;
      center_second += pairs.second[i] / count;
    }
    double spread = 0.0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      spread += (pairs.first[i] - center_first).norm() + (pairs.second[i] - center_second).norm();
    }
    scale_px = std::max(spread / (2.0 * std::sqrt(2.0) * count), 1e-9);
  }

  static Eigen::Matrix3d unit_from_pixel(const Eigen::Vector2d& center, double scale) {
    Eigen::Matrix3d out;
    out << 1.0 / scale, 0.0, -center.x() / scale, 0.0, 1.0 / scale, -center.y() / scale, 0.0, 0.0,
        1.0;
    return out;
  }

  [[nodiscard]] Eigen::Matrix3d first() const { return unit_from_pixel(center_first, scale_px); }

  [[nodiscard]] Eigen::Matrix3d second() const { return unit_from_pixel(center_second, scale_px); }
};

/// Sum over the pairs of 1 - e^2 / limit, where positive: the inverse of the MSAC cost.
template <typename SquaredError>
double score_of(const PointPairs& pairs,
                const Eigen::Matrix3d& model,
                double limit,
                const SquaredError& error) {
  double score = 0.0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    score += std::max(0.0, 1.0 - error(model, pairs.first[i], pairs.second[i]) / limit);
  }
  return score;
}

Eigen::Matrix3d smallest_eigenvector(const Matrix9d& normal) {
  // Only the lower triangle is read.
  const Eigen::SelfAdjointEigenSolver<Matrix9d> solver(normal);
  const Vector9d f = solver.eigenvectors().col(0);
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(f.data());
}

/// One weighted eight-point step: minimises sum w (second^T F first)^2 / |gradient|^2 with weights
/// and gradients of `current`, then makes F singular.
Eigen::Matrix3d fundamental_step(const PointPairs& pairs,
                                 const Normalization& units,
                                 const Eigen::Matrix3d& current,
                                 double limit) {
  Matrix9d normal = Matrix9d::Zero();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Eigen::Vector3d line = current * pairs.first[i].homogeneous();
    const Eigen::Vector3d back = current.transpose() * pairs.second[i].homogeneous();
    const double gradient = line.head<2>().squaredNorm() + back.head<2>().squaredNorm();
    const double error = pairs.second[i].homogeneous().dot(line);
    const double part = error * error / (gradient * limit);
    if (!(part < 1.0)) {
      continue;
    }
    const Eigen::Vector2d a = (pairs.first[i] - units.center_first) / units.scale_px;
    const Eigen::Vector2d b = (pairs.second[i] - units.center_second) / units.scale_px;
    Vector9d row;
    row << b.x() * a.x(), b.x() * a.y(), b.x(), b.y() * a.x(), b.y() * a.y(), b.y(), a.x(), a.y(),
        1.0;
    normal.selfadjointView<Eigen::Lower>().rankUpdate(row, (1.0 - part) / gradient);
  }
  const Eigen::Matrix3d full = smallest_eigenvector(normal);
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(full, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d values = svd.singularValues();
  values[2] = 0.0;
  const Eigen::Matrix3d singular = svd.matrixU() * values.asDiagonal() * svd.matrixV().transpose();
  return (units.second().transpose() * singular * units.first()).normalized();
}

/// One weighted direct linear transformation on the pairs that `current` explains.
Eigen::Matrix3d homography_step(const PointPairs& pairs,
                                const Normalization& units,
                                const Eigen::Matrix3d& current,
                                double limit) {
  Matrix9d normal = Matrix9d::Zero();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const double part = transfer_squared(current, pairs.first[i], pairs.second[i]) / limit;
    if (!(part < 1.0)) {
      continue;
    }
    const Eigen::Vector2d a = (pairs.first[i] - units.center_first) / units.scale_px;
    const Eigen::Vector2d b = (pairs.second[i] - units.center_second) / units.scale_px;
    // Dividing by the depth turns the algebraic into the transfer error.
    const double depth = (current.row(2) * pairs.first[i].homogeneous()).value();
    const double weight = (1.0 - part) / (depth * depth);
    Vector9d row;
    row << a.x(), a.y(), 1.0, 0.0, 0.0, 0.0, -b.x() * a.x(), -b.x() * a.y(), -b.x();
    normal.selfadjointView<Eigen::Lower>().rankUpdate(row, weight);
    row << 0.0, 0.0, 0.0, a.x(), a.y(), 1.0, -b.y() * a.x(), -b.y() * a.y(), -b.y();
    normal.selfadjointView<Eigen::Lower>().rankUpdate(row, weight);
  }
  return (units.second().inverse() * smallest_eigenvector(normal) * units.first()).normalized();
}

/// Repeats `step` as long as the score grows.
template <typename Step, typename SquaredError>
Eigen::Matrix3d refine(const PointPairs& pairs,
                       const Eigen::Matrix3d& start,
                       double max_error_px,
                       const Step& step,
                       const SquaredError& error) {
  const Normalization units(pairs);
  const double limit = max_error_px * max_error_px;
  Eigen::Matrix3d best = start;
  double best_score = score_of(pairs, best, limit, error);
  for (int round = 0; round < kRefinementRounds; ++round) {
    const Eigen::Matrix3d next = step(pairs, units, best, limit);
    if (!next.allFinite()) {
      break;
    }
    const double score = score_of(pairs, next, limit, error);
    if (!(score > best_score)) {
      break;
    }
    const bool settled = score < best_score * (1.0 + kLeastGain);
    best = next;
    best_score = score;
    if (settled) {
      break;
    }
  }
  return best;
}

/// Rotation between two bundles of unit rays with the least squared chord length (Kabsch 1976).
Eigen::Matrix3d fit_rotation(const Eigen::Matrix3d& correlation) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(correlation,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  signs[2] = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

template <typename SquaredError>
std::vector<std::size_t> inliers_of(const PointPairs& pairs,
                                    const Eigen::Matrix3d& model,
                                    double max_error_px,
                                    const SquaredError& error) {
  std::vector<std::size_t> out;
  const double limit = max_error_px * max_error_px;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (error(model, pairs.first[i], pairs.second[i]) <= limit) {
      out.push_back(i);
    }
  }
  return out;
}

}  // namespace

PointPairs PointPairs::thinned(std::size_t most) const {
  if (size() <= most) {
    return *this;
  }
  std::vector<std::size_t> positions(most);
  for (std::size_t i = 0; i < most; ++i) {
    positions[i] = i * size() / most;
  }
  return selected(positions);
}

PointPairs PointPairs::selected(const std::vector<std::size_t>& positions) const {
  PointPairs out;
  out.first.reserve(positions.size());
  out.second.reserve(positions.size());
  for (const std::size_t i : positions) {
    out.first.push_back(first[i]);
    out.second.push_back(second[i]);
  }
  return out;
}

double sampson_squared(const Eigen::Matrix3d& fundamental,
                       const Eigen::Vector2d& first,
                       const Eigen::Vector2d& second) {
  const Eigen::Vector3d line = fundamental * first.homogeneous();
  const Eigen::Vector2d back = fundamental.topLeftCorner<2, 2>().transpose() * second +
                               fundamental.row(2).head<2>().transpose();
  const double error = line.head<2>().dot(second) + line.z();
  const double gradient = line.head<2>().squaredNorm() + back.squaredNorm();
  return gradient > 0.0 ? error * error / gradient : std::numeric_limits<double>::infinity();
}

double transfer_squared(const Eigen::Matrix3d& homography,
                        const Eigen::Vector2d& first,
                        const Eigen::Vector2d& second) {
  const Eigen::Vector3d mapped = homography * first.homogeneous();
  const double squared = (mapped.head<2>() / mapped.z() - second).squaredNorm();
  return std::isfinite(squared) ? squared : std::numeric_limits<double>::infinity();
}

std::optional<Eigen::Matrix3d> search_fundamental(const PointPairs& pairs,
                                                  const SearchLimits& limits) {
  if (pairs.size() < 8) {
    return std::nullopt;
  }
  try {
    cv::Mat mask;
    return from_opencv(cv::findFundamentalMat(
        to_opencv(pairs.first), to_opencv(pairs.second), mask, usac_parameters(limits)));
  } catch (const cv::Exception&) {
    return std::nullopt;  // degenerate input, such as all points in one place
  }
}

std::optional<Eigen::Matrix3d> search_homography(const PointPairs& pairs,
                                                 const SearchLimits& limits) {
  if (pairs.size() < 4) {
    return std::nullopt;
  }
  try {
    cv::Mat mask;
    return from_opencv(cv::findHomography(
        to_opencv(pairs.first), to_opencv(pairs.second), mask, usac_parameters(limits)));
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
}

Eigen::Matrix3d refine_fundamental(const PointPairs& pairs,
                                   const Eigen::Matrix3d& start,
                                   double max_error_px) {
  return refine(pairs, start, max_error_px, fundamental_step, sampson_squared);
}

Eigen::Matrix3d refine_homography(const PointPairs& pairs,
                                  const Eigen::Matrix3d& start,
                                  double max_error_px) {
  return refine(pairs, start, max_error_px, homography_step, transfer_squared);
}

Eigen::Matrix3d fit_rotation_homography(const PointPairs& pairs,
                                        const CalibrationPair& calibration,
                                        double max_error_px) {
  const Eigen::Matrix3d ray_from_pixel_first = calibration.first.inverse();
  const Eigen::Matrix3d ray_from_pixel_second = calibration.second.inverse();
  Eigen::Matrix3d homography = Eigen::Matrix3d::Zero();
  // All pairs first, then twice those that agree, with a gate that closes.
  for (const double gate_px :
       {std::numeric_limits<double>::infinity(), 3.0 * max_error_px, max_error_px}) {
    Eigen::Matrix3d correlation = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      if (std::isfinite(gate_px) &&
          transfer_squared(homography, pairs.first[i], pairs.second[i]) > gate_px * gate_px) {
        continue;
      }
      const Eigen::Vector3d ray_first =
          (ray_from_pixel_first * pairs.first[i].homogeneous()).normalized();
      const Eigen::Vector3d ray_second =
          (ray_from_pixel_second * pairs.second[i].homogeneous()).normalized();
      correlation += ray_second * ray_first.transpose();
    }
    homography = calibration.second * fit_rotation(correlation) * ray_from_pixel_first;
  }
  return homography;
}

std::vector<std::size_t> fundamental_inliers(const PointPairs& pairs,
                                             const Eigen::Matrix3d& fundamental,
                                             double max_error_px) {
  return inliers_of(pairs, fundamental, max_error_px, sampson_squared);
}

std::vector<std::size_t> homography_inliers(const PointPairs& pairs,
                                            const Eigen::Matrix3d& homography,
                                            double max_error_px) {
  return inliers_of(pairs, homography, max_error_px, transfer_squared);
}

}  // namespace trigmesh::internal
