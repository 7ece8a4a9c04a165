#include "sfm/texture/face_splitting.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

namespace trigmesh {
namespace {

constexpr std::uint32_t kUncut = std::numeric_limits<std::uint32_t>::max();

using Edge = std::pair<std::uint32_t, std::uint32_t>;  // lower vertex first
using Face = std::array<std::uint32_t, 3>;

/// Side 0 joins corners 0 and 1, side 1 joins 1 and 2, side 2 joins 2 and 0.
Edge edge_of(const Face& face, std::size_t side) {
  return std::minmax(face[side], face[(side + 1) % 3]);
}

std::vector<Edge> edges_to_cut(const TriangleMesh& mesh, std::span<const std::uint32_t> faces) {
  std::vector<Edge> edges;
  edges.reserve(faces.size() * 3);
  for (const std::uint32_t face : faces) {
    for (std::size_t side = 0; side < 3; ++side) {
      edges.push_back(edge_of(mesh.faces[face], side));
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

void add_middle(const Edge& edge, TriangleMesh& mesh) {
  const auto [a, b] = edge;
  mesh.positions.push_back(0.5F * (mesh.positions[a] + mesh.positions[b]));
  if (!mesh.normals.empty()) {
    const Eigen::Vector3f sum = mesh.normals[a] + mesh.normals[b];
    mesh.normals.push_back(sum.norm() > 1e-6F ? sum.normalized() : mesh.normals[a]);
  }
  if (!mesh.colors.empty()) {
    std::array<std::uint8_t, 3> color{};
    for (std::size_t c = 0; c < 3; ++c) {
      color[c] = static_cast<std::uint8_t>((mesh.colors[a][c] + mesh.colors[b][c]) / 2);
    }
    mesh.colors.push_back(color);
  }
}

/// The parts of a face with middles on some of its sides (kUncut on the others).
void add_parts(const Face& face, const Face& middle, std::vector<Face>& parts) {
  const auto cut_count = std::count_if(
      middle.begin(), middle.end(), [](std::uint32_t vertex) { return vertex != kUncut; });
  if (cut_count == 0) {
    parts.push_back(face);
    return;
  }
  if (cut_count == 3) {
    parts.push_back({face[0], middle[0], middle[2]});
    parts.push_back({middle[0], face[1], middle[1]});
    parts.push_back({middle[2], middle[1], face[2]});
    parts.push_back(middle);
    return;
  }
  // Turn it so that side 0 is cut, and side 2 is not.
  std::size_t first = 0;
  while (middle[first] == kUncut || middle[(first + 2) % 3] != kUncut) {
    ++first;
  }
  const std::uint32_t a = face[first];
  const std::uint32_t b = face[(first + 1) % 3];
  const std::uint32_t c = face[(first + 2) % 3];
  const std::uint32_t ab = middle[first];
  const std::uint32_t bc = middle[(first + 1) % 3];
  if (bc == kUncut) {
    parts.push_back({a, ab, c});
    parts.push_back({ab, b, c});
  } else {
    parts.push_back({ab, b, bc});
    parts.push_back({a, ab, bc});
    parts.push_back({a, bc, c});
  }
}

}  // namespace

TriangleMesh split_faces(const TriangleMesh& mesh, std::span<const std::uint32_t> faces) {
  const std::vector<Edge> cut = edges_to_cut(mesh, faces);
  TriangleMesh result = mesh;
  result.faces.clear();
  result.faces.reserve(mesh.faces.size() + 4 * faces.size());
  for (const Edge& edge : cut) {
    add_middle(edge, result);
  }
  for (const Face& face : mesh.faces) {
    Face middle{};
    for (std::size_t side = 0; side < 3; ++side) {
      const Edge edge = edge_of(face, side);
      const auto found = std::lower_bound(cut.begin(), cut.end(), edge);
      middle[side] = found != cut.end() && *found == edge
                         ? static_cast<std::uint32_t>(mesh.positions.size() +
                                                      static_cast<std::size_t>(found - cut.begin()))
                         : kUncut;
    }
    add_parts(face, middle, result.faces);
  }
  return result;
}

}  // namespace trigmesh
