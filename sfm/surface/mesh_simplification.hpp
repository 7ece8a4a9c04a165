#pragma once

#include "firmware/base/result.hpp"
#include "sfm/surface/triangle_mesh.hpp"

namespace trigmesh {

/// Reduces a mesh to about `max_faces` by edge collapses that keep the quadric error low (Garland
/// and Heckbert, SIGGRAPH 1997, as meshoptimizer does it). Collapses keep positions; afterwards
/// vertices move to where they fit the fine surface best (`fit_to_fine_surface`), and what was
/// folded together is taken apart (`make_two_manifold`). Colours stay; normals do not follow.
/// Returns the error of the collapses in scene units, 0 when the mesh was small enough.
/// Deterministic.
double simplify(std::size_t max_faces, TriangleMesh& mesh);

}  // namespace trigmesh
