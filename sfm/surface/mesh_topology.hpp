#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "sfm/surface/triangle_mesh.hpp"

namespace trigmesh {

/// Vertices of a closed border, in the order in which a triangle that closes the hole would run
/// (against the direction of the faces beside it).
using BoundaryLoop = std::vector<std::uint32_t>;

/// What the faces of a mesh have to do with each other.
struct MeshTopology {
  std::vector<BoundaryLoop>
      boundary_loops;                  ///< by their smallest vertex; each vertex once in a loop
  std::size_t boundary_edges = 0;      ///< edges of one face
  std::size_t non_manifold_edges = 0;  ///< edges of more than two faces, or of two that disagree
};

/// O(F log F).
[[nodiscard]] MeshTopology analyze_topology(const TriangleMesh& mesh);

/// Faces that hang together by vertices.
struct MeshComponents {
  std::vector<std::uint32_t> component_of_face;
  std::vector<std::size_t> face_counts;  ///< per component
  std::vector<double> areas;             ///< per component, squared scene units
};

[[nodiscard]] MeshComponents find_components(const TriangleMesh& mesh);

/// Drops faces for which `keep` is 0, then vertices without faces; order is kept.
void keep_faces(const std::vector<std::uint8_t>& keep, TriangleMesh& mesh);

/// Mean of the normals of the faces around each vertex, each weighted by the angle of its corner
/// (Thurmer and Wuthrich, JGT 1998; Baerentzen and Aanaes, TVCG 2005): it does not depend on how
/// the surface is cut into triangles, and tells inside from outside. +z where no face has an area.
[[nodiscard]] std::vector<Eigen::Vector3f> vertex_normals(const TriangleMesh& mesh);

}  // namespace trigmesh
