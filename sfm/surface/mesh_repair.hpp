#pragma once

#include <cstddef>

#include "sfm/surface/triangle_mesh.hpp"

namespace trigmesh {

/// What had to be done to a mesh.
struct RepairedMesh {
  std::size_t dropped_faces = 0;   ///< degenerate, repeated, or one of two that lie back to back
  std::size_t split_vertices = 0;  ///< copies made of vertices where fans of faces touch
  std::size_t split_edges = 0;     ///< edges that got a vertex in their middle
};

/// Makes a mesh two-manifold with borders: every edge has one face, or two that agree in
/// orientation; the faces around a vertex form one fan. Sheets that touch along an edge or in a
/// vertex are taken apart by copies of vertices (Gueziec et al., "Cutting and stitching: converting
/// sets of polygons to manifold surfaces", TVCG 2001); of the faces around an edge those become
/// neighbours that enclose the same wedge of solid. Two faces on the same three vertices that look
/// opposite ways are a sheet without thickness and go. No position moves; what was closed stays
/// closed. Order is kept, copies come at the end. O(F log F).
RepairedMesh make_two_manifold(TriangleMesh& mesh);

}  // namespace trigmesh
