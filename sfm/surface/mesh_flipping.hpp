#pragma once

#include <cstddef>

#include "sfm/surface/triangle_mesh.hpp"

namespace trigmesh {

/// Turns edges that bend the surface strongly to the other diagonal of their two faces where that
/// bends it less and makes the smallest angle larger: slivers that stand across a noisy surface go,
/// edges of bodies stay. The mesh is two-manifold and stays so; vertices do not move. Returns how
/// many turned.
std::size_t flip_slivers(TriangleMesh& mesh);

}  // namespace trigmesh
