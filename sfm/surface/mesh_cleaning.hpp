#pragma once

#include <cstdint>
#include <vector>

#include "sfm/surface/triangle_mesh.hpp"

namespace trigmesh {

/// Removes faces with a vertex that fewer than `min_support` views agree on, except where all
/// vertices around are well supported (a lone gap is noise of the vote). Returns how many.
std::size_t remove_unsupported(const std::vector<std::uint16_t>& support,
                               int min_support,
                               TriangleMesh& mesh);

/// What was removed.
struct RemovedComponents {
  std::size_t components = 0;
  std::size_t faces = 0;
};

/// Removes the components with less than `min_area_ratio` of the area of the largest.
RemovedComponents remove_small_components(double min_area_ratio, TriangleMesh& mesh);

/// Pulls vertices that stand out of the plane of their neighbours by more than `max_height` (scene
/// units) back to their mean. Returns how many.
std::size_t flatten_spikes(float max_height, TriangleMesh& mesh);

/// `passes` times a step outwards after a step inwards (Taubin, "A signal processing approach to
/// fair surface design", SIGGRAPH 1995): noise goes, volume stays. Borders do not move.
void smooth(int passes, TriangleMesh& mesh);

/// The same along the borders of a two-manifold mesh, which marching cubes and missing support
/// leave with teeth of a voxel: every tooth costs faces that simplification cannot take away.
void smooth_borders(int passes, TriangleMesh& mesh);

}  // namespace trigmesh
