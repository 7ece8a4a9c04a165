#include "sfm/surface/mesh_repair.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "sfm/surface/mesh_topology.hpp"

namespace trigmesh {

namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFU;

using Face = std::array<std::uint32_t, 3>;

/// Side `corner % 3` of face `corner / 3` runs from this corner of the face to the next.
using Corner = std::uint32_t;

Corner next_corner(Corner corner) {
  return corner % 3 == 2 ? corner - 2 : corner + 1;
}

std::uint32_t vertex_of(const TriangleMesh& mesh, Corner corner) {
  return mesh.faces[corner / 3][corner % 3];
}

/// A face side under the number of its edge.
struct Side {
  std::uint64_t edge = 0;  ///< smaller vertex << 32 | larger vertex
  Corner corner = 0;

  auto operator<=>(const Side&) const = default;
};

std::vector<Side> sorted_sides(const TriangleMesh& mesh) {
  std::vector<Side> sides;
  sides.reserve(3 * mesh.faces.size());
  for (Corner corner = 0; corner < 3 * mesh.faces.size(); ++corner) {
    const std::uint32_t from = vertex_of(mesh, corner);
    const std::uint32_t to = vertex_of(mesh, next_corner(corner));
    sides.push_back({(std::uint64_t{std::min(from, to)} << 32U) | std::max(from, to), corner});
  }
  std::sort(sides.begin(), sides.end());
  return sides;
}

/// Whether an odd number of swaps sorts the vertices.
bool is_odd(const Face& face) {
  return (face[0] > face[1]) != ((face[1] > face[2]) != (face[0] > face[2]));
}

/// Marks faces that repeat a vertex or another face; faces on the same vertices cancel each other
/// in pairs that look opposite ways.
std::vector<std::uint8_t> faces_to_keep(const TriangleMesh& mesh) {
  struct Key {
    Face sorted;
    std::uint32_t face;

    auto operator<=>(const Key&) const = default;
  };

  std::vector<std::uint8_t> keep(mesh.faces.size(), 1);
  std::vector<Key> keys;
  keys.reserve(mesh.faces.size());
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    Face sorted = mesh.faces[f];
    std::sort(sorted.begin(), sorted.end());
    keep[f] = sorted[0] != sorted[1] && sorted[1] != sorted[2] ? 1 : 0;
    keys.push_back({sorted, f});
  }
  std::sort(keys.begin(), keys.end());
  for (std::size_t first = 0, last = 0; first < keys.size(); first = last) {
    int balance = 0;
    for (last = first; last < keys.size() && keys[last].sorted == keys[first].sorted; ++last) {
      balance += is_odd(mesh.faces[keys[last].face]) ? 1 : -1;
    }
    bool open = balance != 0;  // one face of the more frequent way stays
    for (std::size_t k = first; k < last && last - first > 1; ++k) {
      const std::uint32_t f = keys[k].face;
      const bool stays = open && is_odd(mesh.faces[f]) == (balance > 0);
      open = open && !stays;
      keep[f] = stays && keep[f] != 0 ? 1 : 0;
    }
  }
  return keep;
}

/// A face around an edge: the direction in which it leaves the edge, as an angle.
struct Leaf {
  float angle = 0.0F;
  Corner corner = 0;
  bool rising = false;  ///< runs from the smaller to the larger vertex

  auto operator<=>(const Leaf&) const = default;
};

std::vector<Leaf> leaves_around(const TriangleMesh& mesh, std::span<const Side> sides) {
  const auto low = static_cast<std::uint32_t>(sides[0].edge >> 32U);
  const auto high = static_cast<std::uint32_t>(sides[0].edge & 0xFFFFFFFFU);
  const Eigen::Vector3f& origin = mesh.positions[low];
  Eigen::Vector3f axis = mesh.positions[high] - origin;
  axis = axis.squaredNorm() > 0.0F ? axis.normalized() : Eigen::Vector3f::UnitZ();
  const Eigen::Vector3f side = axis.unitOrthogonal();
  const Eigen::Vector3f up = axis.cross(side);
  std::vector<Leaf> leaves;
  for (const Side& at : sides) {
    const std::uint32_t tip = vertex_of(mesh, next_corner(next_corner(at.corner)));
    const Eigen::Vector3f leaving = mesh.positions[tip] - origin;
    leaves.push_back({std::atan2(leaving.dot(up), leaving.dot(side)),
                      at.corner,
                      vertex_of(mesh, at.corner) == low});
  }
  std::sort(leaves.begin(), leaves.end());
  return leaves;
}

/// Two sides of one edge across which two faces are neighbours; the same side twice where a face
/// has none.
using SidePair = std::pair<Corner, Corner>;

/// Which sides belong together.
struct Neighbors {
  std::vector<SidePair> pairs;    ///< of edges of two faces that agree
  std::vector<SidePair> crowded;  ///< of all other edges but borders, edge by edge
};

/// Solid lies before a rising face (turning about the edge from low to high) and after a falling
/// one: they pair up like brackets, so that each pair encloses a wedge. Who finds no partner keeps
/// a border.
void pair_wedges(const std::vector<Leaf>& leaves, std::vector<SidePair>& pairs) {
  std::vector<std::uint8_t> paired(leaves.size(), 0);
  std::vector<std::size_t> open;
  for (std::size_t turn = 0; turn < 2 * leaves.size(); ++turn) {
    const std::size_t k = turn % leaves.size();
    if (!leaves[k].rising) {
      if (turn == k) {
        open.push_back(k);
      }
    } else if (paired[k] == 0 && !open.empty()) {
      pairs.emplace_back(leaves[open.back()].corner, leaves[k].corner);
      paired[k] = paired[open.back()] = 1;
      open.pop_back();
    }
  }
  for (std::size_t k = 0; k < leaves.size(); ++k) {
    if (paired[k] == 0) {
      pairs.emplace_back(leaves[k].corner, leaves[k].corner);
    }
  }
}

Neighbors find_neighbors(const TriangleMesh& mesh) {
  const std::vector<Side> sides = sorted_sides(mesh);
  Neighbors found;
  found.pairs.reserve(sides.size() / 2);
  for (std::size_t first = 0, last = 0; first < sides.size(); first = last) {
    for (last = first; last < sides.size() && sides[last].edge == sides[first].edge;) {
      ++last;
    }
    const Corner one = sides[first].corner;
    const Corner other = sides[last - 1].corner;
    if (last - first == 2 && vertex_of(mesh, one) != vertex_of(mesh, other)) {
      found.pairs.emplace_back(one, other);
    } else if (last - first >= 2) {
      pair_wedges(leaves_around(mesh, std::span(sides).subspan(first, last - first)),
                  found.crowded);
    }
  }
  return found;
}

/// Union-find with path halving; the root of a set is its smallest member.
Corner root_of(std::vector<Corner>& parent, Corner i) {
  while (parent[i] != i) {
    parent[i] = parent[parent[i]];
    i = parent[i];
  }
  return i;
}

void unite(std::vector<Corner>& parent, Corner a, Corner b) {
  a = root_of(parent, a);
  b = root_of(parent, b);
  parent[std::max(a, b)] = std::min(a, b);
}

std::uint32_t copy_vertex(std::uint32_t vertex, TriangleMesh& mesh) {
  const auto copy = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.push_back(mesh.positions[vertex]);
  if (!mesh.normals.empty()) {
    mesh.normals.push_back(mesh.normals[vertex]);
  }
  if (!mesh.colors.empty()) {
    mesh.colors.push_back(mesh.colors[vertex]);
  }
  return copy;
}

/// Gives every fan but the first of a vertex a vertex of its own.
std::size_t split_fans(const Neighbors& neighbors, TriangleMesh& mesh) {
  std::vector<Corner> parent(3 * mesh.faces.size());
  std::iota(parent.begin(), parent.end(), 0U);
  for (const std::vector<SidePair>* pairs : {&neighbors.pairs, &neighbors.crowded}) {
    for (const auto& [one, other] : *pairs) {
      if (one != other) {
        unite(parent, one, next_corner(other));
        unite(parent, next_corner(one), other);
      }
    }
  }
  std::vector<Corner> first_fan(mesh.positions.size(), kNone);
  std::size_t copies = 0;
  for (Corner corner = 0; corner < parent.size(); ++corner) {
    // The root comes first: it has its vertex when the others ask.
    const Corner root = root_of(parent, corner);
    std::uint32_t& vertex = mesh.faces[corner / 3][corner % 3];
    if (root != corner) {
      vertex = vertex_of(mesh, root);
    } else if (first_fan[vertex] == kNone) {
      first_fan[vertex] = root;
    } else {
      vertex = copy_vertex(vertex, mesh);
      ++copies;
    }
  }
  return copies;
}

/// Cuts the face of a side in two, from `middle` on the side to the opposite corner.
void cut_face(Corner side, std::uint32_t middle, TriangleMesh& mesh) {
  const Face face = mesh.faces[side / 3];
  const std::size_t k = side % 3;
  mesh.faces[side / 3][(k + 1) % 3] = middle;
  mesh.faces.push_back({middle, face[(k + 1) % 3], face[(k + 2) % 3]});
}

std::uint32_t add_middle(std::uint32_t a, std::uint32_t b, TriangleMesh& mesh) {
  const std::uint32_t middle = copy_vertex(a, mesh);
  mesh.positions[middle] = 0.5F * (mesh.positions[a] + mesh.positions[b]);
  if (!mesh.normals.empty()) {
    const Eigen::Vector3f sum = mesh.normals[a] + mesh.normals[b];
    mesh.normals[middle] = sum.norm() > 0.0F ? sum.normalized() : mesh.normals[a];
  }
  for (std::size_t c = 0; !mesh.colors.empty() && c < 3; ++c) {
    mesh.colors[middle][c] =
        static_cast<std::uint8_t>((mesh.colors[a][c] + mesh.colors[b][c] + 1) / 2);
  }
  return middle;
}

/// One fan at both ends, and yet several edges on the same two vertices: a tunnel pinched to
/// nothing. All but one of them get a vertex in their middle. A face is cut once a call: returns
/// whether nothing was left to do.
bool split_crowded_edges(TriangleMesh& mesh, std::size_t& split_count) {
  const std::vector<SidePair> crowded = find_neighbors(mesh).crowded;
  std::vector<std::uint8_t> cut(mesh.faces.size(), 0);
  std::pair<std::uint32_t, std::uint32_t> last(kNone, kNone);
  for (const auto& [one, other] : crowded) {
    const std::pair<std::uint32_t, std::uint32_t> ends =
        std::minmax({vertex_of(mesh, one), vertex_of(mesh, next_corner(one))});
    const bool is_first = ends != last;
    last = ends;
    if (is_first || cut[one / 3] != 0 || cut[other / 3] != 0) {
      continue;
    }
    cut[one / 3] = 1;
    cut[other / 3] = 1;
    const std::uint32_t middle = add_middle(ends.first, ends.second, mesh);
    cut_face(one, middle, mesh);
    if (one != other) {
      cut_face(other, middle, mesh);
    }
    ++split_count;
  }
  return crowded.empty();
}

}  // namespace

RepairedMesh make_two_manifold(TriangleMesh& mesh) {
  RepairedMesh repaired;
  const std::vector<std::uint8_t> keep = faces_to_keep(mesh);
  repaired.dropped_faces = static_cast<std::size_t>(std::count(keep.begin(), keep.end(), 0));
  keep_faces(keep, mesh);
  Neighbors neighbors = find_neighbors(mesh);
  repaired.split_vertices = split_fans(neighbors, mesh);
  while (!neighbors.crowded.empty() && !split_crowded_edges(mesh, repaired.split_edges)) {
    neighbors = find_neighbors(mesh);
    repaired.split_vertices += split_fans(neighbors, mesh);
  }
  return repaired;
}

}  // namespace trigmesh
