#pragma once

#include <filesystem>
#include <vector>

#include "firmware/base/result.hpp"
#include "sfm/geometry/pose_evaluation.hpp"
#include "sfm/scene/scene.hpp"

namespace trigmesh {

/// Reads the model in a folder of COLMAP files, text or binary (text when both are there). `path`
/// may be that folder, or one that holds it as `sparse`, `model/sparse` or `sparse/0`: a result of
/// ours, its model folder, a workspace of COLMAP. Without a points3D file the model has no points.
/// kNotFound, with the places that were tried, when there is none.
[[nodiscard]] Result<Scene> read_model(const std::filesystem::path& path);

/// Names and poses of the same, without the points.
[[nodiscard]] Result<std::vector<NamedPose>> read_model_poses(const std::filesystem::path& path);

/// Writes cameras.txt, images.txt and points3D.txt into a folder, which is made when missing; each
/// file is replaced whole.
[[nodiscard]] Result<> write_text_model(const Scene& scene, const std::filesystem::path& folder);

/// Writes cameras.bin, images.bin and points3D.bin likewise.
[[nodiscard]] Result<> write_binary_model(const Scene& scene, const std::filesystem::path& folder);

}  // namespace trigmesh
