#include "sfm/coverage/shooting_direction.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "firmware/base/check.hpp"
#include "sfm/coverage/mesh_visibility.hpp"

namespace trigmesh {
namespace {

constexpr double kRadPerDeg = std::numbers::pi / 180.0;
// Weight of the upper edges against the horizontal axes: they only decide what those leave open.
constexpr double kUpperEdgeWeight = 0.005;
constexpr double kDistanceQuantile = 0.25;
constexpr double kBelowLowestRad = 20.0 * kRadPerDeg;
constexpr double kAboveHighestRad = 40.0 * kRadPerDeg;
constexpr double kZenithRad = 85.0 * kRadPerDeg;
constexpr double kGoodShare = 0.7;
constexpr double kLeastShare = 0.25;
constexpr double kLeastCosine = 0.3;
constexpr int kPictureSidePx = 320;

/// A ring of directions around the normal of the gap.
struct Ring {
  double angle_rad;
  int count;
};

constexpr std::array<Ring, 2> kRings{{{25.0 * kRadPerDeg, 6}, {50.0 * kRadPerDeg, 8}}};

double elevation_rad(const Eigen::Vector3d& direction, const Eigen::Vector3d& up) {
  return std::atan2(direction.dot(up), direction.cross(up).norm());
}

/// Angle from a to b, counter-clockwise when looked at from above, (-pi, pi].
double turn_rad(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& up) {
  const Eigen::Vector3d level_a = a - a.dot(up) * up;
  const Eigen::Vector3d level_b = b - b.dot(up) * up;
  return std::atan2(up.dot(level_a.cross(level_b)), level_a.dot(level_b));
}

/// What is known of a gap before places are tried.
struct Surroundings {
  const SurfaceGap& gap;
  const TriangleMesh& mesh;
  Eigen::Vector3d up;
  double distance = 0.0;     ///< from which it would be shot
  double lowest_rad = 0.0;   ///< elevation
  double highest_rad = 0.0;  ///< the same
};

Surroundings surroundings_of(const SurfaceGap& gap,
                             const TriangleMesh& mesh,
                             std::span<const DenseView> views,
                             const Eigen::Vector3d& up) {
  std::vector<double> distances;
  double lowest = kZenithRad;
  double highest = -kZenithRad;
  for (const DenseView& view : views) {
    const Eigen::Vector3d ray = camera_center(view.cam_from_world) - gap.center;
    distances.push_back(ray.norm());
    lowest = std::min(lowest, elevation_rad(ray, up));
    highest = std::max(highest, elevation_rad(ray, up));
  }
  const auto at = distances.begin() + static_cast<std::ptrdiff_t>(
                                          kDistanceQuantile * static_cast<double>(views.size()));
  std::nth_element(distances.begin(), at, distances.end());
  return {gap,
          mesh,
          up,
          *at,
          lowest - kBelowLowestRad,
          std::min(highest + kAboveHighestRad, kZenithRad)};
}

/// A camera at `direction` from the gap, which fills most of its picture.
DenseView camera_at(const Surroundings& around, const Eigen::Vector3d& direction) {
  double radius = 0.0;
  for (const GapPiece& piece : around.gap.pieces) {
    radius = std::max(radius, (piece.position - around.gap.center).norm());
  }
  const double half_angle =
      std::clamp(std::atan2(1.2 * radius, around.distance), 5.0 * kRadPerDeg, 50.0 * kRadPerDeg);
  const double focal_px = 0.5 * kPictureSidePx / std::tan(half_angle);
  const double middle_px = 0.5 * (kPictureSidePx - 1);
  DenseView view;
  view.camera = {CameraModel::kPinhole,
                 kPictureSidePx,
                 kPictureSidePx,
                 focal_px,
                 focal_px,
                 middle_px,
                 middle_px,
                 {}};
  Eigen::Matrix3d cam_from_world;
  cam_from_world.row(2) = -direction;
  cam_from_world.row(0) = (-direction).cross(around.up).normalized();
  cam_from_world.row(1) = cam_from_world.row(2).cross(cam_from_world.row(0));
  view.cam_from_world.rotation = Eigen::Quaterniond(cam_from_world);
  const Eigen::Vector3d center = around.gap.center + around.distance * direction;
  view.cam_from_world.translation = -(view.cam_from_world.rotation * center);
  return view;
}

/// Area of the gap that a camera at `direction` would see well.
double visible_area(const Surroundings& around, const Eigen::Vector3d& direction) {
  const DenseView view = camera_at(around, direction);
  const MeshVisibility visibility(around.mesh, view.camera, view.cam_from_world, kPictureSidePx);
  double area = 0.0;
  for (const GapPiece& piece : around.gap.pieces) {
    const Eigen::Vector3d ray = visibility.center_in_world() - piece.position;
    if (piece.normal.dot(ray) >= kLeastCosine * ray.norm() && visibility.sees(piece.position)) {
      area += piece.area;
    }
  }
  return area;
}

/// The normal, moved into what a person can reach, if that is not far.
std::optional<Eigen::Vector3d> reachable(const Eigen::Vector3d& direction,
                                         const Surroundings& around) {
  const double elevation = elevation_rad(direction, around.up);
  const double allowed = std::clamp(elevation, around.lowest_rad, around.highest_rad);
  const Eigen::Vector3d level = direction - direction.dot(around.up) * around.up;
  if (elevation == allowed) {
    return direction;
  }
  if (std::abs(elevation - allowed) > kRings.back().angle_rad || level.norm() < 1e-6) {
    return std::nullopt;
  }
  return std::cos(allowed) * level.normalized() + std::sin(allowed) * around.up;
}

/// All that are worth a try: the normal first, then farther and farther beside it.
std::vector<Eigen::Vector3d> directions_to_try(const Surroundings& around) {
  const Eigen::Vector3d normal = around.gap.normal;
  std::vector<Eigen::Vector3d> wanted{normal};
  const Eigen::Vector3d side = normal.unitOrthogonal();
  for (const Ring& ring : kRings) {
    for (int i = 0; i < ring.count; ++i) {
      const Eigen::Vector3d axis =
          Eigen::AngleAxisd(2.0 * std::numbers::pi * i / ring.count, normal) * side;
      wanted.emplace_back(Eigen::AngleAxisd(ring.angle_rad, axis) * normal);
    }
  }
  std::vector<Eigen::Vector3d> directions;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const auto direction = reachable(wanted[i], around);
    // Of the rings only what is in reach as it is: moved, they would be other directions twice.
    if (direction && (i == 0 || *direction == wanted[i])) {
      directions.push_back(*direction);
    }
  }
  return directions;
}

ShootingDirection told_from_views(const Surroundings& around,
                                  std::span<const DenseView> views,
                                  const Eigen::Vector3d& direction,
                                  double area) {
  ShootingDirection told;
  double best_cosine = -2.0;
  Eigen::Vector3d nearest = direction;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const Eigen::Vector3d ray =
        (camera_center(views[v].cam_from_world) - around.gap.center).normalized();
    if (ray.dot(direction) > best_cosine) {
      best_cosine = ray.dot(direction);
      told.view = v;
      nearest = ray;
    }
  }
  // Who faces the middle and goes to the left goes clockwise around it, seen from above.
  told.turn_left_rad = -turn_rad(nearest, direction, around.up);
  told.elevation_rad = elevation_rad(direction, around.up);
  told.rise_rad = told.elevation_rad - elevation_rad(nearest, around.up);
  told.visible_area = area;
  return told;
}

}  // namespace

Eigen::Vector3d up_of_views(std::span<const DenseView> views) {
  TM_CHECK(!views.empty());
  Eigen::Matrix3d sideways = Eigen::Matrix3d::Zero();
  Eigen::Vector3d upper_edges = Eigen::Vector3d::Zero();
  for (const DenseView& view : views) {
    const Eigen::Quaterniond world_from_cam = view.cam_from_world.rotation.conjugate();
    const Eigen::Vector3d right = world_from_cam * Eigen::Vector3d::UnitX();
    sideways += right * right.transpose();
    upper_edges -= world_from_cam * Eigen::Vector3d::UnitY();
  }
  const auto count = static_cast<double>(views.size());
  const Eigen::Vector3d upper = upper_edges / count;
  // max -sum (right_i . u)^2 / n + w (upper . u)^2 over unit u: the eigenvector of the smallest
  // value.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(
      sideways / count - kUpperEdgeWeight * upper * upper.transpose());
  const Eigen::Vector3d up = solver.eigenvectors().col(0).normalized();
  return up.dot(upper) < 0.0 ? Eigen::Vector3d(-up) : up;
}

std::optional<ShootingDirection> find_shooting_direction(const SurfaceGap& gap,
                                                         const TriangleMesh& mesh,
                                                         std::span<const DenseView> views,
                                                         const Eigen::Vector3d& up,
                                                         Executor& executor) {
  TM_CHECK(!views.empty());
  const Surroundings around = surroundings_of(gap, mesh, views, up);
  const std::vector<Eigen::Vector3d> directions = directions_to_try(around);
  if (directions.empty()) {
    return std::nullopt;
  }
  std::vector<double> areas(directions.size(), 0.0);
  areas[0] = visible_area(around, directions[0]);
  if (areas[0] < kGoodShare * gap.area) {
    executor.for_each_index(directions.size() - 1, [&](std::size_t i) {
      areas[i + 1] = visible_area(around, directions[i + 1]);
    });
  }
  const auto best = std::max_element(areas.begin(), areas.end());
  if (*best < kLeastShare * gap.area) {
    return std::nullopt;
  }
  const auto index = static_cast<std::size_t>(best - areas.begin());
  return told_from_views(around, views, directions[index], *best);
}

}  // namespace trigmesh
