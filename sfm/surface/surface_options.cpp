#include "sfm/surface/surface_options.hpp"

#include <cmath>

namespace trigmesh {

namespace {

constexpr std::size_t kMinMemoryBytes = std::size_t{4} << 20U;
constexpr std::size_t kMinTileBytes = std::size_t{2} << 20U;

}  // namespace

Result<> SurfaceOptions::validate() const {
  const auto refuse = [](const char* name, double value, const char* rule) {
    return fail(ErrorCode::kInvalidArgument,
                "surface option {} is {}: it must be in {}",
                name,
                value,
                rule);
  };
  if (!(voxel_size >= 0.0 && std::isfinite(voxel_size))) {
    return refuse("voxel_size", voxel_size, "[0, inf)");
  }
  if (!(voxel_footprint_ratio > 0.0 && voxel_footprint_ratio <= 20.0)) {
    return refuse("voxel_footprint_ratio", voxel_footprint_ratio, "(0, 20]");
  }
  if (!(truncation_voxels >= 1.5 && truncation_voxels <= 10.0)) {
    return refuse("truncation_voxels", truncation_voxels, "[1.5, 10]");
  }
  if (!(max_footprint_voxels > 0.0 && std::isfinite(max_footprint_voxels))) {
    return refuse("max_footprint_voxels", max_footprint_voxels, "(0, inf)");
  }
  if (!(free_space_weight_ratio > 0.0 && free_space_weight_ratio <= 1.0)) {
    return refuse("free_space_weight_ratio", free_space_weight_ratio, "(0, 1]");
  }
  if (!(min_voxel_weight > 0.0 && std::isfinite(min_voxel_weight))) {
    return refuse("min_voxel_weight", min_voxel_weight, "(0, inf)");
  }
  if (!(min_support_views >= 0 && min_support_views <= 20)) {
    return refuse("min_support_views", min_support_views, "[0, 20]");
  }
  if (!(min_component_area_ratio >= 0.0 && min_component_area_ratio <= 1.0)) {
    return refuse("min_component_area_ratio", min_component_area_ratio, "[0, 1]");
  }
  if (!(max_filled_hole_voxels >= 0.0 && max_filled_hole_voxels <= 200.0)) {
    return refuse("max_filled_hole_voxels", max_filled_hole_voxels, "[0, 200]");
  }
  if (smoothing_passes < 0 || smoothing_passes > 20) {
    return refuse("smoothing_passes", smoothing_passes, "[0, 20]");
  }
  if (max_faces == 0) {
    return refuse("max_faces", 0.0, "[1, ...]");
  }
  if (max_memory_bytes < kMinMemoryBytes) {
    return refuse("max_memory_bytes", static_cast<double>(max_memory_bytes), "[4 MiB, ...]");
  }
  if (max_tile_bytes < kMinTileBytes) {
    return refuse("max_tile_bytes", static_cast<double>(max_tile_bytes), "[2 MiB, ...]");
  }
  return {};
}

}  // namespace trigmesh
