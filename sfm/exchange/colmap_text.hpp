#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "firmware/base/result.hpp"
#include "sfm/exchange/colmap_model.hpp"
#include "sfm/geometry/pose_evaluation.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// The contents of cameras.txt, images.txt and points3D.txt.
struct ColmapText {
  std::string cameras;
  std::string images;
  std::string points;
};

/// The registered part of a scene. CAMERA_ID, IMAGE_ID and POINT3D_ID are our positions + 1; views
/// without a pose are left out. Numbers have the fewest digits that give the same value back.
/// kUnsupported for a name with a line break.
[[nodiscard]] Result<ColmapText> write_colmap_text(const Scene& scene);

/// Reads what write_colmap_text, COLMAP and others write; see scene_from_colmap for what becomes of
/// identifiers. Hostile input gives kCorruptData with file and line. Memory is bounded by a small
/// multiple of the text.
[[nodiscard]] Result<Scene> read_colmap_text(const ColmapText& text);

/// cameras.txt alone, in order of appearance.
[[nodiscard]] Result<std::vector<ColmapCamera>> read_colmap_cameras(std::string_view text);

/// Names and poses of images.txt alone; the lines of keypoints are skipped unread.
[[nodiscard]] Result<std::vector<NamedPose>> read_colmap_poses(std::string_view text);

}  // namespace trigmesh
