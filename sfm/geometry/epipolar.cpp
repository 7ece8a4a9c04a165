// Epipolar constraint x2^T F x1 = 0.
//
// Eight points: with both point sets moved to mean 0 and mean distance sqrt(2), the least
// eigenvector of A^T A, A of rows x2 (x) x1; then rank two (R. Hartley, "In Defense of the
// Eight-Point Algorithm", PAMI 1997, section 4).
//
// Sampson error: e^2 = (x2^T F x1)^2 / (l2x^2 + l2y^2 + l1x^2 + l1y^2), l2 = F x1, l1 = F^T x2 (R.
// Hartley, A. Zisserman, "Multiple View Geometry", 2nd edition 2003, equation 11.9). With n the
// numerator's root and d the root of the denominator
//
//   d e / d F = x2 x1^T / d - n / d^3 (l2' x1^T + x2 l1'^T),   l' = (lx, ly, 0).
//
// Refinement of F: F = U diag(1, s, 0) V^T, U and V turned by small rotations (A. Bartoli, P.
// Sturm, "Nonlinear Estimation of the Fundamental Matrix with Minimal Parameters", PAMI 2004,
// section 4). Of a pose: E = [t]x R, R <- exp(w) R, t moved on the unit sphere.
#include "sfm/geometry/epipolar.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>

#include "firmware/base/check.hpp"
#include "sfm/geometry/levenberg_marquardt.hpp"

namespace trigmesh {

namespace {

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

Eigen::Quaterniond small_rotation(const Eigen::Vector3d& turn) {
  const double angle = turn.norm();
  return angle > 0.0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle))
                     : Eigen::Quaterniond::Identity();
}

/// Moves the points to mean 0 and mean distance sqrt(2); nothing when they coincide.
std::optional<Eigen::Matrix3d> normalizing_transform(std::span<const Eigen::Vector2d> points) {
  const double n = static_cast<double>(points.size());
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& point : points) {
    mean += point;
  }
  mean /= n;
  double distance = 0.0;
  for (const auto& point : points) {
    distance += (point - mean).norm();
  }
  if (!(distance > 0.0)) {
    return std::nullopt;
  }
  const double scale = std::numbers::sqrt2 * n / distance;
  Eigen::Matrix3d t;
  t << scale, 0.0, -scale * mean.x(), 0.0, scale, -scale * mean.y(), 0.0, 0.0, 1.0;
  return t;
}

/// Sampson error, signed, with its derivative by the nine entries of F.
struct Sampson {
  double value = 0.0;
  Eigen::Matrix3d gradient;
};

std::optional<Sampson> sampson(const Eigen::Matrix3d& fundamental,
                               const Eigen::Vector3d& x1,
                               const Eigen::Vector3d& x2) {
  Eigen::Vector3d l2 = fundamental * x1;
  Eigen::Vector3d l1 = fundamental.transpose() * x2;
  const double n = x2.dot(l2);
  const double d2 = l2.head<2>().squaredNorm() + l1.head<2>().squaredNorm();
  if (!(d2 > 0.0)) {
    return std::nullopt;
  }
  const double inverse_d = 1.0 / std::sqrt(d2);
  l2.z() = 0.0;
  l1.z() = 0.0;
  Sampson out{.value = n * inverse_d, .gradient = {}};
  out.gradient = inverse_d * x2 * x1.transpose() -
                 (out.value / d2) * (l2 * x1.transpose() + x2 * l1.transpose());
  return out;
}

using Points = std::span<const Eigen::Vector2d>;
using Mask = std::span<const std::uint8_t>;

/// Normal equations for F with its derivatives by kDof unknowns.
template <std::size_t kDof>
NormalEquations<static_cast<int>(kDof)> linearize_sampson(
    const Eigen::Matrix3d& fundamental,
    const std::array<Eigen::Matrix3d, kDof>& derivatives,
    Points first,
    Points second,
    Mask mask,
    double loss_scale) {
  NormalEquations<static_cast<int>(kDof)> equations;
  const double scale2 = loss_scale * loss_scale;
  for (std::size_t i = 0; i < first.size(); ++i) {
    if (!mask.empty() && mask[i] == 0) {
      continue;
    }
    const auto error = sampson(fundamental, first[i].homogeneous(), second[i].homogeneous());
    if (!error) {
      continue;
    }
    Eigen::Matrix<double, 1, static_cast<int>(kDof)> jacobian;
    for (std::size_t k = 0; k < kDof; ++k) {
      jacobian[static_cast<Eigen::Index>(k)] = error->gradient.cwiseProduct(derivatives[k]).sum();
    }
    const double ratio = error->value * error->value / scale2;
    equations.add(jacobian, Eigen::Matrix<double, 1, 1>(error->value), 1.0 / (1.0 + ratio));
    equations.cost += scale2 * std::log1p(ratio);
  }
  return equations;
}

/// F = U diag(1, ratio, 0) V^T.
struct FundamentalFactors {
  Eigen::Matrix3d u = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d v = Eigen::Matrix3d::Identity();
  double ratio = 0.0;

  [[nodiscard]] Eigen::Matrix3d product() const {
    return u * Eigen::Vector3d(1.0, ratio, 0.0).asDiagonal() * v.transpose();
  }
};

FundamentalFactors factors_of(const Eigen::Matrix3d& fundamental) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(fundamental,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {svd.matrixU(), svd.matrixV(), svd.singularValues()[1] / svd.singularValues()[0]};
}

}  // namespace

FundamentalEstimate estimate_fundamental(std::span<const Eigen::Vector2d> first,
                                         std::span<const Eigen::Vector2d> second) {
  TM_CHECK(first.size() == second.size());
  constexpr std::size_t kMinMatches = 8;
  constexpr double kSecondNullRatio = 1e-13;  // of eigenvalues, thus the square of singular values
  FundamentalEstimate out;
  if (first.size() < kMinMatches) {
    return out;
  }
  out.outcome = FundamentalOutcome::kDegenerate;
  const auto t1 = normalizing_transform(first);
  const auto t2 = normalizing_transform(second);
  if (!t1 || !t2) {
    return out;
  }
  using Vector9 = Eigen::Matrix<double, 9, 1>;
  using Matrix9 = Eigen::Matrix<double, 9, 9>;
  Matrix9 normal = Matrix9::Zero();
  for (std::size_t i = 0; i < first.size(); ++i) {
    const Eigen::Vector3d x1 = *t1 * first[i].homogeneous();
    const Eigen::Vector3d x2 = *t2 * second[i].homogeneous();
    Vector9 row;
    row << x2.x() * x1, x2.y() * x1, x2.z() * x1;
    normal.noalias() += row * row.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix9> solver(normal);
  if (!(solver.eigenvalues()[1] > kSecondNullRatio * solver.eigenvalues()[8])) {
    return out;
  }
  const Vector9 f = solver.eigenvectors().col(0);
  Eigen::Matrix3d normalized;
  normalized << f.segment<3>(0).transpose(), f.segment<3>(3).transpose(),
      f.segment<3>(6).transpose();
  out.fundamental = enforce_rank_two(t2->transpose() * enforce_rank_two(normalized) * *t1);
  out.outcome = FundamentalOutcome::kOk;
  return out;
}

Eigen::Matrix3d enforce_rank_two(const Eigen::Matrix3d& fundamental) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(fundamental,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d values = svd.singularValues();
  values[2] = 0.0;
  values.normalize();
  return svd.matrixU() * values.asDiagonal() * svd.matrixV().transpose();
}

Eigen::Matrix3d enforce_essential(const Eigen::Matrix3d& essential) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(essential, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * Eigen::Vector3d(1.0, 1.0, 0.0).asDiagonal() * svd.matrixV().transpose();
}

Eigen::Matrix3d essential_from_fundamental(const Eigen::Matrix3d& fundamental,
                                           const Eigen::Matrix3d& first_calibration,
                                           const Eigen::Matrix3d& second_calibration) {
  return second_calibration.transpose() * fundamental * first_calibration;
}

Eigen::Matrix3d fundamental_from_essential(const Eigen::Matrix3d& essential,
                                           const Eigen::Matrix3d& first_calibration,
                                           const Eigen::Matrix3d& second_calibration) {
  return second_calibration.inverse().transpose() * essential * first_calibration.inverse();
}

Eigen::Matrix3d essential_from_pose(const Rigid3& second_from_first) {
  const double length = second_from_first.translation.norm();
  if (!(length > 0.0)) {
    return Eigen::Matrix3d::Zero();
  }
  return skew(second_from_first.translation / length) *
         second_from_first.rotation.toRotationMatrix();
}

double sampson_error_squared(const Eigen::Matrix3d& fundamental,
                             const Eigen::Vector2d& first,
                             const Eigen::Vector2d& second) {
  const Eigen::Vector3d l2 = fundamental * first.homogeneous();
  const Eigen::Vector3d l1 = fundamental.transpose() * second.homogeneous();
  const double n = second.dot(l2.head<2>()) + l2.z();
  const double d2 = l2.head<2>().squaredNorm() + l1.head<2>().squaredNorm();
  return d2 > 0.0 ? n * n / d2 : 0.0;
}

Eigen::Matrix3d refine_fundamental(const Eigen::Matrix3d& start,
                                   std::span<const Eigen::Vector2d> first,
                                   std::span<const Eigen::Vector2d> second,
                                   std::span<const std::uint8_t> mask,
                                   const EpipolarRefinementOptions& options) {
  TM_CHECK(first.size() == second.size());
  constexpr int kDof = 7;
  const auto linearize = [&](const FundamentalFactors& at) {
    std::array<Eigen::Matrix3d, kDof> derivatives;
    const Eigen::Matrix3d diagonal = Eigen::Vector3d(1.0, at.ratio, 0.0).asDiagonal();
    for (int k = 0; k < 3; ++k) {
      const Eigen::Matrix3d turn = skew(Eigen::Vector3d::Unit(k));
      derivatives.at(static_cast<std::size_t>(k)) = at.u * turn * diagonal * at.v.transpose();
      derivatives.at(static_cast<std::size_t>(k) + 3) =
          at.u * diagonal * turn.transpose() * at.v.transpose();
    }
    derivatives[6] = at.u.col(1) * at.v.col(1).transpose();
    return std::optional(linearize_sampson<kDof>(
        at.product(), derivatives, first, second, mask, options.loss_scale));
  };
  const auto step = [](const FundamentalFactors& at, const Eigen::Matrix<double, kDof, 1>& delta) {
    return FundamentalFactors{at.u * small_rotation(delta.head<3>()).toRotationMatrix(),
                              at.v * small_rotation(delta.segment<3>(3)).toRotationMatrix(),
                              at.ratio + delta[6]};
  };
  const auto minimum = levenberg_marquardt<kDof>(
      factors_of(start), linearize, step, {.max_iterations = options.max_iterations});
  return enforce_rank_two(minimum.state.product());
}

Rigid3 refine_relative_pose(const Rigid3& start_second_from_first,
                            const CalibrationPair& calibrations,
                            std::span<const Eigen::Vector2d> first,
                            std::span<const Eigen::Vector2d> second,
                            std::span<const std::uint8_t> mask,
                            const EpipolarRefinementOptions& options) {
  TM_CHECK(first.size() == second.size());
  constexpr int kDof = 5;
  const Eigen::Matrix3d left = calibrations.second.inverse().transpose();
  const Eigen::Matrix3d right = calibrations.first.inverse();
  const auto tangent = [](const Eigen::Vector3d& t) {
    Eigen::Matrix<double, 3, 2> basis;
    basis.col(0) = t.unitOrthogonal();
    basis.col(1) = t.cross(basis.col(0));
    return basis;
  };
  const auto linearize = [&](const Rigid3& at) {
    const Eigen::Matrix3d rotation = at.rotation.toRotationMatrix();
    const Eigen::Matrix3d cross = skew(at.translation);
    const Eigen::Matrix<double, 3, 2> basis = tangent(at.translation);
    std::array<Eigen::Matrix3d, kDof> derivatives;
    for (int k = 0; k < 3; ++k) {
      derivatives.at(static_cast<std::size_t>(k)) =
          left * cross * skew(Eigen::Vector3d::Unit(k)) * rotation * right;
    }
    derivatives[3] = left * skew(basis.col(0)) * rotation * right;
    derivatives[4] = left * skew(basis.col(1)) * rotation * right;
    return std::optional(linearize_sampson<kDof>(
        left * cross * rotation * right, derivatives, first, second, mask, options.loss_scale));
  };
  const auto step = [&](const Rigid3& at, const Eigen::Matrix<double, kDof, 1>& delta) {
    return Rigid3{(small_rotation(delta.head<3>()) * at.rotation).normalized(),
                  (at.translation + tangent(at.translation) * delta.tail<2>()).normalized()};
  };
  Rigid3 start = start_second_from_first;
  start.translation.normalize();
  return levenberg_marquardt<kDof>(
             start, linearize, step, {.max_iterations = options.max_iterations})
      .state;
}

}  // namespace trigmesh
