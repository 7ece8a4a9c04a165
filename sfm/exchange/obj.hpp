#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "firmware/base/result.hpp"
#include "sfm/exchange/mesh_export.hpp"

namespace trigmesh {

/// A file that belongs to a set: a plain name without folder, and its bytes.
struct NamedFile {
  std::string name;
  std::string bytes;
};

struct ObjOptions {
  ModelPlacement placement;
  PageEncoding pages;
  /// The files are STEM.obj, STEM.mtl and STEM.jpg (one page) or STEM_0.jpg, STEM_1.jpg, ...
  /// Letters, digits, '_' and '-' only: names stand unquoted in OBJ and MTL.
  std::string stem = "textured";
};

/// A Wavefront OBJ with normals and texture coordinates (origin at the lower left, as OBJ has it),
/// its material file with one material a page, and the pictures of pages that have faces. The OBJ
/// is the last file, so that whoever finds it finds the others. Placed as the GLB is.
/// kInvalidArgument: check_mesh, placement, encoding, stem.
[[nodiscard]] Result<std::vector<NamedFile>> write_obj(const TexturedMesh& textured,
                                                       const ObjOptions& options = {});

/// Writes a set of files into a folder that exists, each with write_file_atomically.
[[nodiscard]] Result<> write_files(const std::filesystem::path& folder,
                                   const std::vector<NamedFile>& files);

}  // namespace trigmesh
