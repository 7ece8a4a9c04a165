#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "firmware/base/result.hpp"
#include "sfm/geometry/pose_evaluation.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// The contents of cameras.bin, images.bin and points3D.bin (COLMAP's layout before 4.0, which
/// newer ones read).
struct ColmapBinary {
  std::string cameras;
  std::string images;
  std::string points;
};

/// The binary twin of write_colmap_text: same identifiers, same order, same failures.
[[nodiscard]] Result<ColmapBinary> write_colmap_binary(const Scene& scene);

/// The binary twin of read_colmap_text. Counts are checked against the bytes that are left before
/// anything is allocated; hostile input gives kCorruptData with file and position.
[[nodiscard]] Result<Scene> read_colmap_binary(const ColmapBinary& bytes);

/// Names and poses of images.bin alone.
[[nodiscard]] Result<std::vector<NamedPose>> read_colmap_binary_poses(std::string_view images);

}  // namespace trigmesh
