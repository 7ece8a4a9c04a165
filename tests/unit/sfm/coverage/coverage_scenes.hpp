#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "sfm/dense/dense_view.hpp"
#include "sfm/surface/triangle_mesh.hpp"

namespace trigmesh::test {

inline constexpr double kRadPerDeg = std::numbers::pi / 180.0;

/// Appends the square `middle` +- `a` +- `b`, cut into n x n squares, which looks along a x b.
inline void add_square(const Eigen::Vector3f& middle,
                       const Eigen::Vector3f& a,
                       const Eigen::Vector3f& b,
                       std::uint32_t n,
                       TriangleMesh& mesh) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (std::uint32_t y = 0; y <= n; ++y) {
    for (std::uint32_t x = 0; x <= n; ++x) {
      const float u = 2.0F * static_cast<float>(x) / static_cast<float>(n) - 1.0F;
      const float v = 2.0F * static_cast<float>(y) / static_cast<float>(n) - 1.0F;
      mesh.positions.emplace_back(middle + u * a + v * b);
    }
  }
  for (std::uint32_t y = 0; y < n; ++y) {
    for (std::uint32_t x = 0; x < n; ++x) {
      const std::uint32_t at = first + y * (n + 1) + x;
      mesh.faces.push_back({at, at + 1, at + n + 2});
      mesh.faces.push_back({at, at + n + 2, at + n + 1});
    }
  }
}

/// Welds vertices at the same place (to a thousandth).
inline TriangleMesh welded(const TriangleMesh& mesh) {
  TriangleMesh result;
  std::vector<std::uint32_t> number(mesh.positions.size());
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    std::size_t j = 0;
    while (j < result.positions.size() &&
           (result.positions[j] - mesh.positions[i]).norm() > 1e-3F) {
      ++j;
    }
    if (j == result.positions.size()) {
      result.positions.push_back(mesh.positions[i]);
    }
    number[i] = static_cast<std::uint32_t>(j);
  }
  for (const auto& face : mesh.faces) {
    result.faces.push_back({number[face[0]], number[face[1]], number[face[2]]});
  }
  return result;
}

/// The cube [-1, 1]^3 without the sides whose outward normals are in `missing`, each of n x n
/// squares.
inline TriangleMesh make_box(const std::vector<Eigen::Vector3f>& missing, std::uint32_t n = 8) {
  TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    for (const float sign : {-1.0F, 1.0F}) {
      const Eigen::Vector3f normal = sign * Eigen::Vector3f::Unit(axis);
      bool is_missing = false;
      for (const Eigen::Vector3f& other : missing) {
        is_missing = is_missing || normal.dot(other) > 0.9F;
      }
      if (!is_missing) {
        const Eigen::Vector3f a = Eigen::Vector3f::Unit((axis + 1) % 3);
        add_square(normal, a, normal.cross(a), n, mesh);
      }
    }
  }
  return welded(mesh);
}

/// Looks from `center` at `target`, z of the world upwards in the picture.
inline DenseView view_from(const Eigen::Vector3d& center,
                           const Eigen::Vector3d& target = Eigen::Vector3d::Zero()) {
  DenseView view;
  view.camera = {CameraModel::kPinhole, 640, 480, 500.0, 500.0, 319.5, 239.5, {}};
  Eigen::Matrix3d cam_from_world;
  cam_from_world.row(2) = (target - center).normalized();
  cam_from_world.row(0) =
      Eigen::Vector3d(cam_from_world.row(2)).cross(Eigen::Vector3d::UnitZ()).normalized();
  cam_from_world.row(1) =
      Eigen::Vector3d(cam_from_world.row(2)).cross(Eigen::Vector3d(cam_from_world.row(0)));
  view.cam_from_world.rotation = Eigen::Quaterniond(cam_from_world);
  view.cam_from_world.translation = -(view.cam_from_world.rotation * center);
  return view;
}

/// A direction counter-clockwise from +x, and above the horizon.
inline Eigen::Vector3d direction(double azimuth_deg, double elevation_deg) {
  const double azimuth = azimuth_deg * kRadPerDeg;
  const double elevation = elevation_deg * kRadPerDeg;
  return {std::cos(azimuth) * std::cos(elevation),
          std::sin(azimuth) * std::cos(elevation),
          std::sin(elevation)};
}

/// Views every 15 degrees around the origin, from `first_deg` to `last_deg`, at two heights.
inline std::vector<DenseView> orbit(double first_deg, double last_deg, double distance = 6.0) {
  std::vector<DenseView> views;
  for (const double elevation_deg : {20.0, 50.0}) {
    for (double azimuth_deg = first_deg; azimuth_deg <= last_deg; azimuth_deg += 15.0) {
      views.push_back(view_from(distance * direction(azimuth_deg, elevation_deg)));
      views.back().name = std::to_string(static_cast<int>(azimuth_deg)) + "_" +
                          std::to_string(static_cast<int>(elevation_deg));
    }
  }
  return views;
}

}  // namespace trigmesh::test
