#include "sfm/surface/mesh_cleaning.hpp"

#include <algorithm>

#include "firmware/base/check.hpp"
#include "sfm/surface/mesh_topology.hpp"

namespace trigmesh {

namespace {

// Taubin's factors: pass band 0.1.
constexpr float kShrink = 0.5F;
constexpr float kGrow = -0.53F;

/// Mean of the neighbours of each vertex, each weighted by its number of common faces.
std::vector<Eigen::Vector3f> neighbor_means(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3f> sums(mesh.positions.size(), Eigen::Vector3f::Zero());
  std::vector<float> counts(mesh.positions.size(), 0.0F);
  for (const auto& face : mesh.faces) {
    for (std::size_t k = 0; k < 3; ++k) {
      sums[face[k]] += mesh.positions[face[(k + 1) % 3]] + mesh.positions[face[(k + 2) % 3]];
      counts[face[k]] += 2.0F;
    }
  }
  for (std::size_t v = 0; v < sums.size(); ++v) {
    sums[v] = counts[v] > 0.0F ? Eigen::Vector3f(sums[v] / counts[v]) : mesh.positions[v];
  }
  return sums;
}

std::vector<std::uint8_t> border_vertices(const TriangleMesh& mesh) {
  std::vector<std::uint8_t> on_border(mesh.positions.size(), 0);
  for (const BoundaryLoop& loop : analyze_topology(mesh).boundary_loops) {
    for (const std::uint32_t v : loop) {
      on_border[v] = 1;
    }
  }
  return on_border;
}

/// The vertices of all borders, loop by loop.
std::vector<Eigen::Vector3f> border_points(const std::vector<BoundaryLoop>& loops,
                                           const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3f> points;
  for (const BoundaryLoop& loop : loops) {
    for (const std::uint32_t v : loop) {
      points.push_back(mesh.positions[v]);
    }
  }
  return points;
}

}  // namespace

std::size_t remove_unsupported(const std::vector<std::uint16_t>& support,
                               int min_support,
                               TriangleMesh& mesh) {
  TM_CHECK(support.size() == mesh.positions.size());
  std::vector<std::uint8_t> keep(mesh.faces.size());
  for (std::size_t f = 0; f < keep.size(); ++f) {
    int weak = 0;
    for (const std::uint32_t v : mesh.faces[f]) {
      weak += static_cast<int>(support[v]) < min_support ? 1 : 0;
    }
    keep[f] = weak <= 1 ? 1 : 0;
  }
  const auto removed = static_cast<std::size_t>(std::count(keep.begin(), keep.end(), 0));
  keep_faces(keep, mesh);
  return removed;
}

RemovedComponents remove_small_components(double min_area_ratio, TriangleMesh& mesh) {
  const MeshComponents components = find_components(mesh);
  if (components.areas.empty()) {
    return {};
  }
  const double limit =
      min_area_ratio * *std::max_element(components.areas.begin(), components.areas.end());
  RemovedComponents removed;
  for (std::size_t c = 0; c < components.areas.size(); ++c) {
    if (components.areas[c] < limit) {
      ++removed.components;
      removed.faces += components.face_counts[c];
    }
  }
  std::vector<std::uint8_t> keep(mesh.faces.size());
  for (std::size_t f = 0; f < keep.size(); ++f) {
    keep[f] = components.areas[components.component_of_face[f]] >= limit ? 1 : 0;
  }
  keep_faces(keep, mesh);
  return removed;
}

std::size_t flatten_spikes(float max_height, TriangleMesh& mesh) {
  const std::vector<Eigen::Vector3f> means = neighbor_means(mesh);
  const std::vector<std::uint8_t> on_border = border_vertices(mesh);
  std::size_t count = 0;
  for (std::size_t v = 0; v < means.size(); ++v) {
    if (on_border[v] == 0 && (mesh.positions[v] - means[v]).norm() > max_height) {
      mesh.positions[v] = means[v];
      ++count;
    }
  }
  return count;
}

void smooth_borders(int passes, TriangleMesh& mesh) {
  const std::vector<BoundaryLoop> loops = analyze_topology(mesh).boundary_loops;
  for (int step = 0; step < 2 * passes; ++step) {
    const float factor = step % 2 == 0 ? kShrink : kGrow;
    const std::vector<Eigen::Vector3f> before = border_points(loops, mesh);
    std::size_t i = 0;
    for (const BoundaryLoop& loop : loops) {
      const std::size_t first = i;
      for (std::size_t k = 0; k < loop.size(); ++k, ++i) {
        const Eigen::Vector3f& last = before[first + (k + loop.size() - 1) % loop.size()];
        const Eigen::Vector3f& next = before[first + (k + 1) % loop.size()];
        mesh.positions[loop[k]] = before[i] + factor * (0.5F * (last + next) - before[i]);
      }
    }
  }
}

void smooth(int passes, TriangleMesh& mesh) {
  const std::vector<std::uint8_t> on_border = border_vertices(mesh);
  for (int step = 0; step < 2 * passes; ++step) {
    const float factor = step % 2 == 0 ? kShrink : kGrow;
    const std::vector<Eigen::Vector3f> means = neighbor_means(mesh);
    for (std::size_t v = 0; v < means.size(); ++v) {
      if (on_border[v] == 0) {
        mesh.positions[v] += factor * (means[v] - mesh.positions[v]);
      }
    }
  }
}

}  // namespace trigmesh
