#pragma once

#include <cmath>
#include <cstdint>

#include "sfm/surface/triangle_mesh.hpp"

namespace trigmesh::test {

/// A sheet of n x n squares of edge 1 in the plane z = 0, facing +z, with colours and normals.
inline TriangleMesh make_sheet(std::uint32_t n, float offset_x = 0.0F) {
  TriangleMesh mesh;
  for (std::uint32_t y = 0; y <= n; ++y) {
    for (std::uint32_t x = 0; x <= n; ++x) {
      mesh.positions.emplace_back(static_cast<float>(x) + offset_x, static_cast<float>(y), 0.0F);
      mesh.normals.emplace_back(Eigen::Vector3f::UnitZ());
      mesh.colors.push_back({10, 20, 30});
    }
  }
  for (std::uint32_t y = 0; y < n; ++y) {
    for (std::uint32_t x = 0; x < n; ++x) {
      const std::uint32_t a = y * (n + 1) + x;
      mesh.faces.push_back({a, a + 1, a + n + 2});
      mesh.faces.push_back({a, a + n + 2, a + n + 1});
    }
  }
  return mesh;
}

/// Both in one.
inline TriangleMesh join(TriangleMesh a, const TriangleMesh& b) {
  const auto shift = static_cast<std::uint32_t>(a.positions.size());
  a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
  a.normals.insert(a.normals.end(), b.normals.begin(), b.normals.end());
  a.colors.insert(a.colors.end(), b.colors.begin(), b.colors.end());
  for (const auto& face : b.faces) {
    a.faces.push_back({face[0] + shift, face[1] + shift, face[2] + shift});
  }
  return a;
}

}  // namespace trigmesh::test
