#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "sfm/surface/triangle_mesh.hpp"

namespace trigmesh {

/// Moves the vertices of a simplified mesh to where its faces meet the fine surface best.
/// `mesh.positions` are those of the fine mesh, `fine_faces` its faces; the simplified `mesh.faces`
/// use some of its vertices. Each used vertex stands for the fine vertices that are nearest to it
/// along the fine mesh; it goes to the point nearest to the planes of their faces (the quadric
/// error of Garland and Heckbert, SIGGRAPH 1997): noise is averaged instead of picked, edges stay
/// sharp. Borders do not move. Deterministic.
void fit_to_fine_surface(std::span<const std::array<std::uint32_t, 3>> fine_faces,
                         TriangleMesh& mesh);

}  // namespace trigmesh
