#include "sfm/surface/mesh_topology.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Geometry>

#include "firmware/base/check.hpp"

namespace trigmesh {

namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFU;

/// An edge as a face runs along it.
struct DirectedEdge {
  std::uint64_t key = 0;  ///< smaller vertex << 32 | larger vertex
  bool falling = false;   ///< runs from the larger to the smaller vertex

  auto operator<=>(const DirectedEdge&) const = default;
};

std::vector<DirectedEdge> sorted_edges(const TriangleMesh& mesh) {
  std::vector<DirectedEdge> edges;
  edges.reserve(3 * mesh.faces.size());
  for (const auto& face : mesh.faces) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t from = face[k];
      const std::uint32_t to = face[(k + 1) % 3];
      edges.push_back({(std::uint64_t{std::min(from, to)} << 32U) | std::max(from, to), from > to});
    }
  }
  std::sort(edges.begin(), edges.end());
  return edges;
}

/// An edge of one face, turned round: as the missing face would run along it.
struct BoundaryEdge {
  std::uint32_t from = 0;
  std::uint32_t to = 0;

  auto operator<=>(const BoundaryEdge&) const = default;
};

/// Takes closed loops off the path whenever it meets itself, so that every loop is simple.
void walk_loops(const std::vector<BoundaryEdge>& edges, std::vector<BoundaryLoop>& loops) {
  std::vector<std::uint8_t> used(edges.size(), 0);
  for (std::size_t start = 0; start < edges.size(); ++start) {
    BoundaryLoop path;
    std::size_t edge = start;
    while (used[edge] == 0) {
      used[edge] = 1;
      path.push_back(edges[edge].from);
      const std::uint32_t at = edges[edge].to;
      const auto met = std::find(path.begin(), path.end(), at);
      if (met != path.end()) {
        loops.emplace_back(met, path.end());
        path.erase(met, path.end());
      }
      auto next = std::lower_bound(edges.begin(), edges.end(), BoundaryEdge{at, 0});
      while (next != edges.end() && next->from == at &&
             used[static_cast<std::size_t>(next - edges.begin())] != 0) {
        ++next;
      }
      if (next == edges.end() || next->from != at) {
        break;
      }
      edge = static_cast<std::size_t>(next - edges.begin());
    }
  }
}

/// Union-find with path halving; the root of a set is its smallest member.
std::uint32_t root_of(std::vector<std::uint32_t>& parent, std::uint32_t i) {
  while (parent[i] != i) {
    parent[i] = parent[parent[i]];
    i = parent[i];
  }
  return i;
}

Eigen::Vector3f scaled_normal(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& face) {
  const Eigen::Vector3f& a = mesh.positions[face[0]];
  return (mesh.positions[face[1]] - a).cross(mesh.positions[face[2]] - a);
}

template <typename T>
void move_kept(const std::vector<std::uint32_t>& new_index,
               std::size_t count,
               std::vector<T>& values) {
  if (values.empty()) {
    return;
  }
  for (std::size_t v = 0; v < new_index.size(); ++v) {
    if (new_index[v] != kNone) {
      values[new_index[v]] = values[v];
    }
  }
  values.resize(count);
}

}  // namespace

MeshTopology analyze_topology(const TriangleMesh& mesh) {
  const std::vector<DirectedEdge> edges = sorted_edges(mesh);
  MeshTopology topology;
  std::vector<BoundaryEdge> boundary;
  for (std::size_t first = 0; first < edges.size();) {
    std::size_t last = first;
    while (last < edges.size() && edges[last].key == edges[first].key) {
      ++last;
    }
    const std::size_t count = last - first;
    if (count == 1) {
      const auto low = static_cast<std::uint32_t>(edges[first].key >> 32U);
      const auto high = static_cast<std::uint32_t>(edges[first].key & 0xFFFFFFFFU);
      boundary.push_back(edges[first].falling ? BoundaryEdge{low, high} : BoundaryEdge{high, low});
    } else if (count > 2 || edges[first].falling == edges[first + 1].falling) {
      ++topology.non_manifold_edges;
    }
    first = last;
  }
  std::sort(boundary.begin(), boundary.end());
  topology.boundary_edges = boundary.size();
  walk_loops(boundary, topology.boundary_loops);
  return topology;
}

MeshComponents find_components(const TriangleMesh& mesh) {
  std::vector<std::uint32_t> parent(mesh.positions.size());
  std::iota(parent.begin(), parent.end(), 0U);
  for (const auto& face : mesh.faces) {
    for (std::size_t k = 1; k < 3; ++k) {
      const std::uint32_t a = root_of(parent, face[0]);
      const std::uint32_t b = root_of(parent, face[k]);
      parent[std::max(a, b)] = std::min(a, b);
    }
  }
  MeshComponents components;
  std::vector<std::uint32_t> number(mesh.positions.size(), kNone);
  components.component_of_face.reserve(mesh.faces.size());
  for (const auto& face : mesh.faces) {
    std::uint32_t& component = number[root_of(parent, face[0])];
    if (component == kNone) {
      component = static_cast<std::uint32_t>(components.areas.size());
      components.areas.push_back(0.0);
      components.face_counts.push_back(0);
    }
    components.component_of_face.push_back(component);
    components.areas[component] += 0.5 * static_cast<double>(scaled_normal(mesh, face).norm());
    ++components.face_counts[component];
  }
  return components;
}

void keep_faces(const std::vector<std::uint8_t>& keep, TriangleMesh& mesh) {
  TM_CHECK(keep.size() == mesh.faces.size());
  std::vector<std::uint32_t> new_index(mesh.positions.size(), kNone);
  std::size_t faces = 0;
  for (std::size_t f = 0; f < keep.size(); ++f) {
    if (keep[f] != 0) {
      mesh.faces[faces++] = mesh.faces[f];
      for (const std::uint32_t v : mesh.faces[f]) {
        new_index[v] = 0;
      }
    }
  }
  mesh.faces.resize(faces);
  std::uint32_t vertices = 0;
  for (std::uint32_t& index : new_index) {
    if (index != kNone) {
      index = vertices++;
    }
  }
  for (auto& face : mesh.faces) {
    for (std::uint32_t& v : face) {
      v = new_index[v];
    }
  }
  move_kept(new_index, vertices, mesh.positions);
  move_kept(new_index, vertices, mesh.normals);
  move_kept(new_index, vertices, mesh.colors);
}

std::vector<Eigen::Vector3f> vertex_normals(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3f> normals(mesh.positions.size(), Eigen::Vector3f::Zero());
  for (const auto& face : mesh.faces) {
    const Eigen::Vector3f scaled = scaled_normal(mesh, face);
    const float length = scaled.norm();
    if (!(length > 0.0F)) {
      continue;
    }
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3f& tip = mesh.positions[face[k]];
      const Eigen::Vector3f one = mesh.positions[face[(k + 1) % 3]] - tip;
      const Eigen::Vector3f other = mesh.positions[face[(k + 2) % 3]] - tip;
      normals[face[k]] += std::atan2(length, one.dot(other)) / length * scaled;
    }
  }
  for (Eigen::Vector3f& normal : normals) {
    const float length = normal.norm();
    normal = length > 0.0F ? Eigen::Vector3f(normal / length) : Eigen::Vector3f::UnitZ();
  }
  return normals;
}

}  // namespace trigmesh
