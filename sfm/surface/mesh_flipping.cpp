#include "sfm/surface/mesh_flipping.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <set>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

namespace trigmesh {

namespace {

constexpr int kSweeps = 6;
// Only edges that bend the surface by more than this (cosine, about 25 degrees) are looked at: long
// faces along weak curvature fit a surface better than even ones.
constexpr float kBentCosine = 0.9F;

using Edge = std::pair<std::uint32_t, std::uint32_t>;

/// An edge and one of its faces.
struct Side {
  Edge edge;  ///< smaller vertex first
  std::uint32_t face = 0;

  auto operator<=>(const Side&) const = default;
};

std::vector<Side> sorted_sides(const TriangleMesh& mesh) {
  std::vector<Side> sides;
  sides.reserve(3 * mesh.faces.size());
  for (std::uint32_t f = 0; f < mesh.faces.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k) {
      sides.push_back({std::minmax({mesh.faces[f][k], mesh.faces[f][(k + 1) % 3]}), f});
    }
  }
  std::sort(sides.begin(), sides.end());
  return sides;
}

/// Two faces (a, b, c) and (b, a, d).
struct Quad {
  std::uint32_t a = 0;
  std::uint32_t b = 0;
  std::uint32_t c = 0;
  std::uint32_t d = 0;
};

Quad quad_of(const TriangleMesh& mesh, std::uint32_t face, std::uint32_t other, const Edge& edge) {
  const auto tip_place = [&](std::uint32_t f) {
    std::size_t k = 0;
    while (mesh.faces[f][k] == edge.first || mesh.faces[f][k] == edge.second) {
      ++k;
    }
    return k;
  };
  const std::size_t k = tip_place(face);
  return {mesh.faces[face][(k + 1) % 3],
          mesh.faces[face][(k + 2) % 3],
          mesh.faces[face][k],
          mesh.faces[other][tip_place(other)]};
}

/// How good two faces on both sides of an edge are.
struct Shape {
  float smallest_sine;  ///< of their angles; 0 = degenerate
  float bend_cosine;    ///< between their normals
};

Shape shape_of(const Eigen::Vector3f& a,
               const Eigen::Vector3f& b,
               const Eigen::Vector3f& c,
               const Eigen::Vector3f& d) {
  const Eigen::Vector3f first = (b - a).cross(c - a);
  const Eigen::Vector3f second = (d - a).cross(b - a);
  const float one = first.norm();
  const float two = second.norm();
  // The smallest angle lies between the two longest sides.
  const auto sine = [](float twice_area, float u, float v, float w) {
    const float shortest = std::min({u, v, w});
    return twice_area * shortest / std::max(u * v * w, 1e-30F);
  };
  const float base = (b - a).norm();
  return {std::min(sine(one, base, (c - a).norm(), (c - b).norm()),
                   sine(two, base, (d - a).norm(), (d - b).norm())),
          one > 0.0F && two > 0.0F ? first.dot(second) / (one * two) : -1.0F};
}

bool improves(const TriangleMesh& mesh, const Quad& q) {
  const auto& p = mesh.positions;
  const Shape before = shape_of(p[q.a], p[q.b], p[q.c], p[q.d]);
  const Shape after = shape_of(p[q.d], p[q.c], p[q.a], p[q.b]);
  return before.bend_cosine < kBentCosine && after.bend_cosine > before.bend_cosine + 0.01F &&
         after.smallest_sine > before.smallest_sine * 1.01F;
}

std::size_t sweep(TriangleMesh& mesh) {
  const std::vector<Side> sides = sorted_sides(mesh);
  std::vector<std::uint8_t> turned(mesh.faces.size(), 0);
  std::set<Edge> made;
  std::size_t count = 0;
  for (std::size_t k = 0; k + 1 < sides.size(); ++k) {
    const std::uint32_t face = sides[k].face;
    const std::uint32_t other = sides[k + 1].face;
    if (sides[k].edge != sides[k + 1].edge || turned[face] != 0 || turned[other] != 0) {
      continue;
    }
    const Quad q = quad_of(mesh, face, other, sides[k].edge);
    const Edge across = std::minmax({q.c, q.d});
    const auto place = std::lower_bound(sides.begin(), sides.end(), Side{across, 0});
    const bool exists = place != sides.end() && place->edge == across;
    if (q.c == q.d || exists || made.count(across) != 0 || !improves(mesh, q)) {
      continue;
    }
    mesh.faces[face] = {q.a, q.d, q.c};
    mesh.faces[other] = {q.b, q.c, q.d};
    turned[face] = 1;
    turned[other] = 1;
    made.insert(across);
    ++count;
  }
  return count;
}

}  // namespace

std::size_t flip_slivers(TriangleMesh& mesh) {
  std::size_t count = 0;
  for (int round = 0; round < kSweeps; ++round) {
    const std::size_t turned = sweep(mesh);
    count += turned;
    if (turned == 0) {
      break;
    }
  }
  return count;
}

}  // namespace trigmesh
