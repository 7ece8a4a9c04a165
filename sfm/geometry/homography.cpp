// Homography x2 ~ H x1: with both point sets moved to mean 0 and mean distance sqrt(2), the least
// eigenvector of A^T A, A of the two independent rows of x2 x (H x1) = 0 (R. Hartley, A. Zisserman,
// "Multiple View Geometry", 2nd edition 2003, algorithm 4.2). Turning on the spot gives H ~ K2 R
// K1^-1 (equation 8.3 there).
//
// The two motions of a plane n.X = 1: with H = R (I + t n^T), |n| = 1, the symmetric matrix H^T H -
// I = n w^T + w n^T, w = t + |t|^2 / 2 n, is the same when n and w change places (the twofold
// ambiguity of H. C. Longuet-Higgins, "The visual ambiguity of a moving plane", Proc. R. Soc. B
// 223, 1984).
#include "sfm/geometry/homography.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>

#include "firmware/base/check.hpp"

namespace trigmesh {

namespace {

using Points = std::span<const Eigen::Vector2d>;
using Mask = std::span<const std::uint8_t>;

bool used(Mask mask, std::size_t i) {
  return mask.empty() || mask[i] != 0;
}

std::optional<Eigen::Matrix3d> normalizing_transform(Points points, Mask mask, double count) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (used(mask, i)) {
      mean += points[i] / count;
    }
  }
  double distance = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (used(mask, i)) {
      distance += (points[i] - mean).norm();
    }
  }
  if (!(distance > 0.0)) {
    return std::nullopt;
  }
  const double scale = std::numbers::sqrt2 * count / distance;
  Eigen::Matrix3d t;
  t << scale, 0.0, -scale * mean.x(), 0.0, scale, -scale * mean.y(), 0.0, 0.0, 1.0;
  return t;
}

}  // namespace

HomographyEstimate estimate_homography(std::span<const Eigen::Vector2d> first,
                                       std::span<const Eigen::Vector2d> second,
                                       std::span<const std::uint8_t> mask) {
  TM_CHECK(first.size() == second.size());
  TM_CHECK(mask.empty() || mask.size() == first.size());
  constexpr double kMinMatches = 4.0;
  constexpr double kSecondNullRatio = 1e-13;  // of eigenvalues, thus the square of singular values
  double count = 0.0;
  for (std::size_t i = 0; i < first.size(); ++i) {
    count += used(mask, i) ? 1.0 : 0.0;
  }
  HomographyEstimate out;
  if (count < kMinMatches) {
    return out;
  }
  out.outcome = HomographyOutcome::kDegenerate;
  const auto t1 = normalizing_transform(first, mask, count);
  const auto t2 = normalizing_transform(second, mask, count);
  if (!t1 || !t2) {
    return out;
  }
  using Vector9 = Eigen::Matrix<double, 9, 1>;
  using Matrix9 = Eigen::Matrix<double, 9, 9>;
  Matrix9 normal = Matrix9::Zero();
  for (std::size_t i = 0; i < first.size(); ++i) {
    if (!used(mask, i)) {
      continue;
    }
    const Eigen::Vector3d x1 = *t1 * first[i].homogeneous();
    const Eigen::Vector3d x2 = *t2 * second[i].homogeneous();
    Vector9 row;
    row << Eigen::Vector3d::Zero(), -x1, x2.y() * x1;
    normal.noalias() += row * row.transpose();
    row << x1, Eigen::Vector3d::Zero(), -x2.x() * x1;
    normal.noalias() += row * row.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix9> solver(normal);
  if (!(solver.eigenvalues()[1] > kSecondNullRatio * solver.eigenvalues()[8])) {
    return out;
  }
  const Vector9 h = solver.eigenvectors().col(0);
  Eigen::Matrix3d normalized;
  normalized << h.segment<3>(0).transpose(), h.segment<3>(3).transpose(),
      h.segment<3>(6).transpose();
  // A homography that maps a plane to a line is what collinear points leave.
  if (!(std::abs(normalized.determinant()) > 1e-9)) {
    return out;
  }
  out.second_from_first = t2->inverse() * normalized * *t1;
  out.second_from_first /= std::copysign(out.second_from_first.norm(), normalized.determinant());
  out.outcome = HomographyOutcome::kOk;
  return out;
}

double transfer_error_squared(const Eigen::Matrix3d& second_from_first,
                              const Eigen::Vector2d& first,
                              const Eigen::Vector2d& second) {
  const Eigen::Vector3d mapped = second_from_first * first.homogeneous();
  const double error = (mapped.hnormalized() - second).squaredNorm();
  return std::isfinite(error) ? error : std::numeric_limits<double>::infinity();
}

double symmetric_transfer_error_squared(const Eigen::Matrix3d& second_from_first,
                                        const Eigen::Vector2d& first,
                                        const Eigen::Vector2d& second) {
  return transfer_error_squared(second_from_first, first, second) +
         transfer_error_squared(second_from_first.inverse(), second, first);
}

std::optional<RotationFromHomography> rotation_from_homography(
    const Eigen::Matrix3d& second_from_first,
    const Eigen::Matrix3d& first_calibration,
    const Eigen::Matrix3d& second_calibration) {
  Eigen::Matrix3d m = second_calibration.inverse() * second_from_first * first_calibration;
  const double determinant = m.determinant();
  const double norm = m.norm();
  if (!std::isfinite(norm) || !(std::abs(determinant) > 1e-12 * norm * norm * norm)) {
    return std::nullopt;
  }
  m /= std::cbrt(determinant);
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d rotation = svd.matrixU() * svd.matrixV().transpose();
  return RotationFromHomography{Eigen::Quaterniond(rotation).normalized(),
                                (svd.singularValues().array() - 1.0).abs().maxCoeff()};
}

std::optional<Rigid3> other_motion_of_plane(const Eigen::Matrix3d& second_from_first_normalized,
                                            const Rigid3& second_from_first) {
  constexpr double kSmallest = 1e-9;
  const Eigen::Vector3d scales =
      Eigen::JacobiSVD<Eigen::Matrix3d>(second_from_first_normalized).singularValues();
  if (!(scales[2] > kSmallest * scales[0])) {
    return std::nullopt;
  }
  const Eigen::Matrix3d h = second_from_first_normalized /
                            std::copysign(scales[1], second_from_first_normalized.determinant());
  const Eigen::Matrix3d turn = second_from_first.rotation.toRotationMatrix();
  const Eigen::JacobiSVD<Eigen::Matrix3d> shift(turn.transpose() * h - Eigen::Matrix3d::Identity(),
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double length = shift.singularValues()[0];
  const Eigen::Vector3d normal = shift.matrixV().col(0);
  const double bend = 0.5 * length * length;
  const Eigen::Vector3d w = length * shift.matrixU().col(0) + bend * normal;
  if (!(w.norm() > kSmallest)) {
    return std::nullopt;
  }
  const Eigen::Vector3d other_normal = w.normalized();
  const Eigen::Vector3d other_shift = w.norm() * normal - bend * other_normal;
  const Eigen::Matrix3d stretch =
      Eigen::Matrix3d::Identity() + other_shift * other_normal.transpose();
  if (!(std::abs(stretch.determinant()) > kSmallest)) {
    return std::nullopt;
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(h * stretch.inverse(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d rotation = svd.matrixU() * svd.matrixV().transpose();
  return Rigid3{Eigen::Quaterniond(rotation).normalized(), (rotation * other_shift).normalized()};
}

}  // namespace trigmesh
