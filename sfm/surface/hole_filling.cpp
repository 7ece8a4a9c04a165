#include "sfm/surface/hole_filling.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "sfm/surface/hole_patch.hpp"
#include "sfm/surface/mesh_topology.hpp"

namespace trigmesh {

namespace {

// The triangulation of a border takes time with its cube.
constexpr std::size_t kMaxBorderEdges = 240;

SurfaceHole describe(const BoundaryLoop& loop, const TriangleMesh& mesh) {
  SurfaceHole hole;
  Eigen::Vector3f low = mesh.positions[loop.front()];
  Eigen::Vector3f high = low;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Eigen::Vector3f& point = mesh.positions[loop[i]];
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
    hole.center_in_world += point / static_cast<float>(loop.size());
    hole.perimeter += (mesh.positions[loop[(i + 1) % loop.size()]] - point).norm();
  }
  hole.diameter = (high - low).norm();
  hole.edge_count = loop.size();
  return hole;
}

/// Sum and number of the neighbours of the vertices that lie on borders of holes to be filled.
struct BorderNeighbors {
  std::vector<Eigen::Vector3f> sums;
  std::vector<float> counts;

  explicit BorderNeighbors(const TriangleMesh& mesh)
      : sums(mesh.positions.size(), Eigen::Vector3f::Zero()), counts(mesh.positions.size(), 0.0F) {
    for (const auto& face : mesh.faces) {
      for (std::size_t k = 0; k < 3; ++k) {
        sums[face[k]] += mesh.positions[face[(k + 1) % 3]] + mesh.positions[face[(k + 2) % 3]];
        counts[face[k]] += 2.0F;
      }
    }
  }
};

using Edge = std::pair<std::uint32_t, std::uint32_t>;

/// Edges of the mesh between border vertices.
std::vector<Edge> sorted_edges_of(const TriangleMesh& mesh,
                                  const std::vector<std::uint8_t>& on_border) {
  std::vector<Edge> edges;
  for (const auto& face : mesh.faces) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = face[k];
      const std::uint32_t b = face[(k + 1) % 3];
      if (on_border[a] != 0 && on_border[b] != 0) {
        edges.emplace_back(std::min(a, b), std::max(a, b));
      }
    }
  }
  std::sort(edges.begin(), edges.end());
  return edges;
}

/// The edges of a patch, in vertices of the mesh, that run between border vertices across the hole.
std::vector<Edge> spanning_edges(const HolePatch& patch, const BoundaryLoop& loop) {
  const auto n = static_cast<std::uint32_t>(patch.border_count);
  std::vector<Edge> spanning;
  for (const auto& face : patch.faces) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = face[k];
      const std::uint32_t b = face[(k + 1) % 3];
      const bool border_edge = a < n && b < n && ((a + 1) % n == b || (b + 1) % n == a);
      if (a < n && b < n && !border_edge) {
        spanning.emplace_back(std::min(loop[a], loop[b]), std::max(loop[a], loop[b]));
      }
    }
  }
  return spanning;
}

/// Edges between border vertices that a patch must not use again: those of the mesh, and those of
/// the patches that were put in (holes that touch in two vertices may want the same).
struct TakenEdges {
  std::vector<Edge> of_mesh;  ///< sorted
  std::set<Edge> of_patches;

  [[nodiscard]] bool contain_any(const std::vector<Edge>& edges) const {
    return std::any_of(edges.begin(), edges.end(), [&](const Edge& edge) {
      return of_patches.count(edge) != 0 ||
             std::binary_search(of_mesh.begin(), of_mesh.end(), edge);
    });
  }
};

std::array<std::uint8_t, 3> mean_color(const TriangleMesh& mesh,
                                       const std::array<std::uint32_t, 3>& of) {
  std::array<std::uint8_t, 3> mean{};
  for (std::size_t c = 0; c < 3; ++c) {
    const int sum = mesh.colors[of[0]][c] + mesh.colors[of[1]][c] + mesh.colors[of[2]][c];
    mean[c] = static_cast<std::uint8_t>((sum + 1) / 3);
  }
  return mean;
}

void append(const HolePatch& patch, const BoundaryLoop& loop, TriangleMesh& mesh) {
  std::vector<std::uint32_t> vertex(loop.begin(), loop.end());
  for (std::size_t i = patch.border_count; i < patch.points.size(); ++i) {
    std::array<std::uint32_t, 3> parents = patch.parents[i - patch.border_count];
    for (std::uint32_t& parent : parents) {
      parent = vertex[parent];
    }
    vertex.push_back(static_cast<std::uint32_t>(mesh.positions.size()));
    mesh.positions.push_back(patch.points[i]);
    if (!mesh.normals.empty()) {
      mesh.normals.emplace_back(
          (mesh.normals[parents[0]] + mesh.normals[parents[1]] + mesh.normals[parents[2]])
              .normalized());
    }
    if (!mesh.colors.empty()) {
      mesh.colors.push_back(mean_color(mesh, parents));
    }
  }
  for (const auto& face : patch.faces) {
    mesh.faces.push_back({vertex[face[0]], vertex[face[1]], vertex[face[2]]});
  }
}

}  // namespace

FilledHoles fill_holes(float max_diameter, float edge_length, TriangleMesh& mesh) {
  const std::vector<BoundaryLoop> loops = analyze_topology(mesh).boundary_loops;
  const BorderNeighbors around(mesh);
  std::vector<std::uint8_t> on_border(mesh.positions.size(), 0);
  for (const BoundaryLoop& loop : loops) {
    for (const std::uint32_t v : loop) {
      on_border[v] = 1;
    }
  }
  TakenEdges taken{sorted_edges_of(mesh, on_border), {}};
  FilledHoles result;
  for (const BoundaryLoop& loop : loops) {
    const SurfaceHole hole = describe(loop, mesh);
    if (loop.size() < 3 || loop.size() > kMaxBorderEdges || hole.diameter > max_diameter) {
      result.open.push_back(hole);
      continue;
    }
    std::vector<Eigen::Vector3f> border;
    std::vector<Eigen::Vector3f> anchors;
    for (const std::uint32_t v : loop) {
      border.push_back(mesh.positions[v]);
      anchors.emplace_back(around.sums[v] / around.counts[v]);
    }
    HolePatch patch = minimal_area_patch(border);
    refine(edge_length, patch);
    const std::vector<Edge> spanning = spanning_edges(patch, loop);
    if (taken.contain_any(spanning)) {
      result.open.push_back(hole);
      continue;
    }
    taken.of_patches.insert(spanning.begin(), spanning.end());
    fair(anchors, patch);
    append(patch, loop, mesh);
    ++result.filled_count;
  }
  std::stable_sort(result.open.begin(), result.open.end(), [](const auto& a, const auto& b) {
    return a.perimeter > b.perimeter;
  });
  return result;
}

}  // namespace trigmesh
