#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "sfm/surface/marching_cubes.hpp"
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

/// All blocks of [-2, 2)^3 of voxels of edge 0.5 with `distance(voxel position)` in voxels / 3.
template <typename Distance>
VoxelGrid make_grid(const Distance& distance) {
  std::vector<BlockKey> keys;
  for (int z = -2; z < 2; ++z) {
    for (int y = -2; y < 2; ++y) {
      for (int x = -2; x < 2; ++x) {
        keys.push_back(*block_key({x, y, z}));
      }
    }
  }
  VoxelGrid grid(0.5, keys);
  for (std::size_t b = 0; b < grid.size(); ++b) {
    for (int v = 0; v < 512; ++v) {
      const Eigen::Vector3i at =
          8 * block_position(grid.key(b)) + Eigen::Vector3i(v % 8, v / 8 % 8, v / 64);
      const auto i = static_cast<std::size_t>(v);
      grid.block(b).distance[i] = std::clamp(distance(at.cast<float>()) / 3.0F, -1.0F, 1.0F);
      grid.block(b).weight[i] = 1.0F;
    }
  }
  return grid;
}

/// White noise inside of a box: full of tunnels and thin walls.
inline VoxelGrid make_noise(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(-1.0F, 1.0F);
  return make_grid([&](const Eigen::Vector3f& p) {
    return p.cwiseAbs().maxCoeff() > 13.0F ? 1.0F : uniform(random);
  });
}

/// Whether every edge has one face, or two that run along it in opposite directions, the faces
/// around each vertex are one fan, and no two faces have the same three vertices. Plain and slow.
inline bool is_two_manifold(const TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> directed;
  // For each vertex the edges opposite to it.
  std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> links(mesh.positions.size());
  std::map<std::array<std::uint32_t, 3>, int> faces;
  for (auto face : mesh.faces) {
    for (std::size_t k = 0; k < 3; ++k) {
      ++directed[{face[k], face[(k + 1) % 3]}];
      links[face[k]].emplace_back(face[(k + 1) % 3], face[(k + 2) % 3]);
    }
    std::sort(face.begin(), face.end());
    ++faces[face];
  }
  const auto once = [](const auto& entry) { return entry.second == 1; };
  if (!std::all_of(directed.begin(), directed.end(), once) ||
      !std::all_of(faces.begin(), faces.end(), once)) {
    return false;
  }
  for (auto& link : links) {
    if (link.empty()) {
      continue;
    }
    // From the first edge of an open chain, else from any, as far as it goes.
    std::map<std::uint32_t, std::uint32_t> next(link.begin(), link.end());
    std::uint32_t start = link.front().first;
    for (const auto& edge : link) {
      const bool has_before = std::any_of(
          link.begin(), link.end(), [&](const auto& other) { return other.second == edge.first; });
      start = has_before ? start : edge.first;
    }
    std::size_t steps = 0;
    for (std::uint32_t at = start; next.count(at) != 0 && steps <= link.size(); ++steps) {
      const std::uint32_t to = next.at(at);
      next.erase(at);
      at = to;
    }
    if (steps != link.size()) {
      return false;
    }
  }
  return true;
}

}  // namespace trigmesh::test
