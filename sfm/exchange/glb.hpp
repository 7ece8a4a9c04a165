#pragma once

#include <string>

#include "firmware/base/result.hpp"
#include "sfm/exchange/mesh_export.hpp"

namespace trigmesh {

struct GlbOptions {
  ModelPlacement placement;
  PageEncoding pages;
  std::string mesh_name = "mesh";
  std::string generator = "trigmesh";  ///< name and version of the program
};

/// A binary glTF 2.0 file that holds everything: one mesh; per page with faces one primitive, one
/// material (KHR_materials_unlit, since light is in the photographs already; a matte material for
/// readers without it) and one picture. Vertices are split where their texture coordinates differ.
/// `asset.extras` says what a unit of length is ("metre" or "scene unit") and holds the matrix
/// model_from_world, column by column. The same mesh gives the same bytes. kInvalidArgument:
/// check_mesh, placement, encoding; kLimitExceeded: more than 4 GiB.
[[nodiscard]] Result<std::string> write_glb(const TexturedMesh& textured,
                                            const GlbOptions& options = {});

/// The same for a mesh without texture; vertex colours (or white) are written as COLOR_0, linear in
/// 16 bits, as glTF wants them.
[[nodiscard]] Result<std::string> write_glb(const TriangleMesh& mesh,
                                            const GlbOptions& options = {});

}  // namespace trigmesh
