#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "sfm/surface/triangle_mesh.hpp"

namespace trigmesh {

inline constexpr std::uint32_t kNoFace = std::numeric_limits<std::uint32_t>::max();

/// Per face, the face on the other side of the edges (0,1), (1,2), (2,0); kNoFace at a border and
/// at edges with more than two faces. O(faces log faces).
[[nodiscard]] std::vector<std::array<std::uint32_t, 3>> face_neighbors(const TriangleMesh& mesh);

}  // namespace trigmesh
