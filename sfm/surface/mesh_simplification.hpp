#pragma once

#include "firmware/base/result.hpp"
#include "sfm/surface/triangle_mesh.hpp"

namespace trigmesh {

/// Reduces a mesh to about `max_faces` by edge collapses that keep the quadric error low (Garland
/// and Heckbert, SIGGRAPH 1997, as meshoptimizer does it). Remaining vertices keep their position,
/// normal and colour; borders stay where they are as long as the budget allows; what collapses
/// folded together is taken apart (`make_two_manifold`). Returns the error in scene units, 0 when
/// the mesh was small enough. Deterministic.
double simplify(std::size_t max_faces, TriangleMesh& mesh);

}  // namespace trigmesh
