#pragma once

#include <cstddef>
#include <vector>

#include "sfm/surface/surface_options.hpp"
#include "sfm/surface/triangle_mesh.hpp"

namespace trigmesh {

/// What became of the holes of a mesh.
struct FilledHoles {
  std::size_t filled_count = 0;
  std::vector<SurfaceHole> open;  ///< by falling perimeter
};

/// Closes holes whose border fits a box of diagonal `max_diameter`: the triangulation of the border
/// with the least area (Barequet and Sharir, "Filling gaps in the boundary of a polyhedron", CAGD
/// 1995), refined to edges of about `edge_length` and faired by the umbrella operator applied twice
/// (Liepa, "Filling holes in meshes", SGP 2003). New vertices get mean normals and colours. A
/// border of more than a few hundred edges, or whose patch would share an edge with other faces, is
/// left open. Lengths in scene units.
FilledHoles fill_holes(float max_diameter, float edge_length, TriangleMesh& mesh);

}  // namespace trigmesh
