#pragma once

#include "sfm/texture/textured_mesh.hpp"

namespace trigmesh::test_support {

struct TexturedGlobeOptions {
  int rings = 24;       ///< of faces from pole to pole, even
  int sectors = 48;     ///< around
  double radius = 1.0;  ///< scene units
  int page_size_px = 256;
};

/// A globe in front of a camera at the origin (centre (0, 0, 3), y down as in the world): the upper
/// half lies on page 0 (warm), the lower on page 1 (cold). Pages are chequered along longitude and
/// latitude, with a white field near u = 0, v = 0, so that a mirrored or flipped picture shows.
/// Positions, unit normals, no vertex colours. The seam at longitude 0 has one vertex and two
/// texture coordinates.
[[nodiscard]] TexturedMesh make_textured_globe(const TexturedGlobeOptions& options = {});

}  // namespace trigmesh::test_support
