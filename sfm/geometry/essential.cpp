// Four poses of an essential matrix E = U diag(1, 1, 0) V^T (up to sign):
//
//   R = U W V^T or U W^T V^T,  t = +u3 or -u3,  W = (0 -1 0; 1 0 0; 0 0 1)
//
// (R. Hartley, A. Zisserman, "Multiple View Geometry", 2nd edition 2003, result 9.19); the true one
// has the points in front of both cameras (section 9.6.3), counted over all matches as one may be
// wrong or far away.
//
// Depths: the nearest points of the rays d1 p and d2 q - t, with p = R x1 and q = x2 in the second
// camera,
//
//   d1 (p.p) - d2 (p.q) = -p.t,   d1 (p.q) - d2 (q.q) = -q.t.
#include "sfm/geometry/essential.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>

#include "firmware/base/check.hpp"

namespace trigmesh {

namespace {

/// Matches in front of both cameras, and matches that can tell.
struct FrontCount {
  std::size_t in_front = 0;
  std::size_t judged = 0;
};

FrontCount count_in_front(const Rigid3& pose,
                          std::span<const Eigen::Vector2d> first,
                          std::span<const Eigen::Vector2d> second,
                          std::span<const std::uint8_t> mask,
                          double min_angle_rad) {
  FrontCount count;
  for (std::size_t i = 0; i < first.size(); ++i) {
    if (!mask.empty() && mask[i] == 0) {
      continue;
    }
    const TwoViewDepths depths = two_view_depths(pose, first[i], second[i]);
    if (depths.angle_rad > 0.0 && depths.angle_rad >= min_angle_rad) {
      ++count.judged;
      count.in_front += depths.first > 0.0 && depths.second > 0.0 ? 1 : 0;
    }
  }
  return count;
}

}  // namespace

std::array<Rigid3, 4> decompose_essential(const Eigen::Matrix3d& essential) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(essential, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  Eigen::Matrix3d v = svd.matrixV();
  u *= u.determinant() < 0.0 ? -1.0 : 1.0;
  v *= v.determinant() < 0.0 ? -1.0 : 1.0;
  Eigen::Matrix3d w;
  w << 0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0;
  const Eigen::Quaterniond first(Eigen::Matrix3d(u * w * v.transpose()));
  const Eigen::Quaterniond second(Eigen::Matrix3d(u * w.transpose() * v.transpose()));
  const Eigen::Vector3d t = u.col(2);
  return {Rigid3{first.normalized(), t},
          Rigid3{first.normalized(), -t},
          Rigid3{second.normalized(), t},
          Rigid3{second.normalized(), -t}};
}

TwoViewDepths two_view_depths(const Rigid3& second_from_first,
                              const Eigen::Vector2d& first,
                              const Eigen::Vector2d& second) {
  const Eigen::Vector3d p = second_from_first.rotation * Eigen::Vector3d(first.homogeneous());
  const Eigen::Vector3d q = second.homogeneous();
  const Eigen::Vector3d& t = second_from_first.translation;
  const double sine2 = p.cross(q).squaredNorm();
  TwoViewDepths out;
  if (!(sine2 > 0.0)) {
    return out;
  }
  const double pq = p.dot(q);
  out.angle_rad = std::atan2(std::sqrt(sine2), pq);
  out.first = (pq * q.dot(t) - q.squaredNorm() * p.dot(t)) / sine2;
  out.second = (p.squaredNorm() * q.dot(t) - pq * p.dot(t)) / sine2;
  return out;
}

std::string_view to_string(CheiralityOutcome outcome) {
  switch (outcome) {
    case CheiralityOutcome::kOk:
      return "ok";
    case CheiralityOutcome::kTooFewPoints:
      return "too_few_points";
    case CheiralityOutcome::kTooFewInFront:
      return "too_few_in_front";
    case CheiralityOutcome::kAmbiguous:
      return "ambiguous";
  }
  return "unknown";
}

PoseChoice choose_pose(const Eigen::Matrix3d& essential,
                       std::span<const Eigen::Vector2d> first,
                       std::span<const Eigen::Vector2d> second,
                       std::span<const std::uint8_t> mask,
                       const CheiralityOptions& options) {
  TM_CHECK(first.size() == second.size());
  PoseChoice best;
  std::size_t least_judged = first.size();
  for (const Rigid3& pose : decompose_essential(essential)) {
    const FrontCount count = count_in_front(pose, first, second, mask, options.min_angle_rad);
    least_judged = std::min(least_judged, count.judged);
    if (count.in_front > best.in_front) {
      best.runner_up = best.in_front;
      best.in_front = count.in_front;
      best.judged = count.judged;
      best.second_from_first = pose;
    } else {
      best.runner_up = std::max(best.runner_up, count.in_front);
    }
  }
  const double limit = options.max_runner_up_ratio * static_cast<double>(best.in_front);
  if (least_judged == 0) {  // for one of the two rotations all rays are parallel
    best.outcome = CheiralityOutcome::kTooFewPoints;
  } else if (2 * best.in_front < best.judged || best.in_front == 0) {
    best.outcome = CheiralityOutcome::kTooFewInFront;
  } else if (static_cast<double>(best.runner_up) >= limit) {
    best.outcome = CheiralityOutcome::kAmbiguous;
  } else {
    best.outcome = CheiralityOutcome::kOk;
  }
  return best;
}

}  // namespace trigmesh
