#pragma once

#include <cstdint>
#include <span>

#include "sfm/surface/triangle_mesh.hpp"

namespace trigmesh {

/// The same surface with the edges of some faces (ascending) cut at their middles: those faces
/// become four, and their neighbours two to four, because they share the cut edges; no crack opens.
/// The first vertices are those of `mesh`. Normals and colours of new vertices are means.
[[nodiscard]] TriangleMesh split_faces(const TriangleMesh& mesh,
                                       std::span<const std::uint32_t> faces);

}  // namespace trigmesh
