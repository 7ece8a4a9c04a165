#include "sfm/surface/mesh_fitting.hpp"

#include <algorithm>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "sfm/surface/mesh_topology.hpp"

namespace trigmesh {

namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFU;
// Rings of fine faces around a vertex; what is farther speaks for nobody.
constexpr int kMaxRings = 12;
// How strongly a vertex stays where it is, of the weight of all planes: along a flat surface the
// planes say nothing.
constexpr double kStayRatio = 0.05;

using Faces = std::span<const std::array<std::uint32_t, 3>>;

/// Which used vertex each fine vertex belongs to, ring by ring; kNone where no ring came.
std::vector<std::uint32_t> owners_of(Faces fine_faces, const TriangleMesh& mesh) {
  std::vector<std::uint32_t> owner(mesh.positions.size(), kNone);
  for (const auto& face : mesh.faces) {
    for (const std::uint32_t v : face) {
      owner[v] = v;
    }
  }
  std::vector<std::pair<std::uint32_t, std::uint32_t>> ring;  // vertex, owner
  for (int round = 0; round < kMaxRings; ++round) {
    ring.clear();
    for (const auto& face : fine_faces) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t from = owner[face[k]];
        for (std::size_t other = 1; other < 3 && from != kNone; ++other) {
          const std::uint32_t to = face[(k + other) % 3];
          if (owner[to] == kNone) {
            ring.emplace_back(to, from);
          }
        }
      }
    }
    if (ring.empty()) {
      break;
    }
    const auto distance = [&](const auto& step) {
      return (mesh.positions[step.first] - mesh.positions[step.second]).squaredNorm();
    };
    for (const auto& step : ring) {
      std::uint32_t& current = owner[step.first];
      if (current == kNone || distance(step) < distance(std::pair(step.first, current))) {
        current = step.second;
      }
    }
  }
  return owner;
}

/// Sum over planes n.(x - origin) = d, each with the area of its face: |A x - b|.
struct Quadric {
  Eigen::Matrix3d a = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  double radius = 0.0;  ///< of what was added, around the origin
};

void add_face(const Eigen::Vector3d& p,
              const Eigen::Vector3d& q,
              const Eigen::Vector3d& r,
              Quadric& quadric) {
  const Eigen::Vector3d scaled = (q - p).cross(r - p);
  const double length = scaled.norm();
  if (length > 0.0) {
    quadric.a += scaled * scaled.transpose() / length;
    quadric.b += scaled * (scaled.dot(p) / length);
    quadric.radius = std::max(quadric.radius, p.norm());
  }
}

/// How far the vertex goes; not at all when the planes send it out of what it stands for.
Eigen::Vector3d step_of(const Quadric& quadric) {
  const double weight = quadric.a.trace();
  if (!(weight > 0.0)) {
    return Eigen::Vector3d::Zero();
  }
  const Eigen::Matrix3d a = quadric.a + kStayRatio * weight * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d step = a.ldlt().solve(quadric.b);
  return step.norm() <= quadric.radius ? step : Eigen::Vector3d(Eigen::Vector3d::Zero());
}

}  // namespace

void fit_to_fine_surface(Faces fine_faces, TriangleMesh& mesh) {
  const std::vector<std::uint32_t> owner = owners_of(fine_faces, mesh);
  std::vector<std::uint32_t> number(mesh.positions.size(), kNone);
  std::vector<std::uint32_t> used;
  for (std::uint32_t v = 0; v < owner.size(); ++v) {
    if (owner[v] == v) {
      number[v] = static_cast<std::uint32_t>(used.size());
      used.push_back(v);
    }
  }
  std::vector<Quadric> quadrics(used.size());
  for (const auto& face : fine_faces) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t to = owner[face[k]];
      if (to != kNone) {
        const auto from_owner = [&](std::size_t corner) -> Eigen::Vector3d {
          return (mesh.positions[face[corner % 3]] - mesh.positions[to]).cast<double>();
        };
        add_face(from_owner(k), from_owner(k + 1), from_owner(k + 2), quadrics[number[to]]);
      }
    }
  }
  for (const BoundaryLoop& loop : analyze_topology(mesh).boundary_loops) {
    for (const std::uint32_t v : loop) {
      quadrics[number[v]] = Quadric();
    }
  }
  for (std::size_t i = 0; i < used.size(); ++i) {
    mesh.positions[used[i]] += step_of(quadrics[i]).cast<float>();
  }
}

}  // namespace trigmesh
