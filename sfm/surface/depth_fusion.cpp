#include "sfm/surface/depth_fusion.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include "firmware/base/check.hpp"
#include "sfm/surface/depth_frame.hpp"
#include "sfm/surface/tsdf_integration.hpp"

namespace trigmesh {

namespace {

// Every so many rows and columns one pixel is looked at for the footprint.
constexpr int kFootprintStride = 7;
// Blocks that one piece of parallel work integrates.
constexpr std::size_t kBlocksPerTask = 64;

void append_footprints(const DepthMap& map, std::vector<float>& footprints) {
  const auto focal = static_cast<float>(std::max(map.camera.fx_px, map.camera.fy_px));
  for (int y = 0; y < map.depth.rows; y += kFootprintStride) {
    for (int x = 0; x < map.depth.cols; x += kFootprintStride) {
      const float depth = map.depth.at<float>(y, x);
      if (depth > 0.0F && std::isfinite(depth)) {
        footprints.push_back(depth / focal);
      }
    }
  }
}

/// Union of two sorted lists.
std::vector<BlockKey> merge(const std::vector<BlockKey>& a, const std::vector<BlockKey>& b) {
  std::vector<BlockKey> both;
  both.reserve(a.size() + b.size());
  std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(both));
  return both;
}

DepthFrameOptions frame_options(const SurfaceOptions& options, double voxel_size) {
  return {.voxel_size = static_cast<float>(voxel_size),
          .max_footprint_voxels = static_cast<float>(options.max_footprint_voxels)};
}

/// Blocks near any surface, or nothing when they do not fit the budget.
Result<std::optional<std::vector<BlockKey>>> find_blocks(std::span<const DenseView> views,
                                                         const DepthMapSource& depth_maps,
                                                         const SurfaceOptions& options,
                                                         double voxel_size) {
  std::vector<BlockKey> blocks;
  for (std::size_t view = 0; view < views.size(); ++view) {
    TM_ASSIGN_OR_RETURN(const DepthMap map, depth_maps.load(view));
    TM_ASSIGN_OR_RETURN(const DepthFrame frame,
                        make_depth_frame(map,
                                         views[view].cam_from_world,
                                         frame_options(options, voxel_size)));
    blocks = merge(
        blocks, blocks_near_surface(frame, voxel_size, options.truncation_voxels * voxel_size));
    if (VoxelGrid::estimated_bytes(blocks.size()) > options.max_memory_bytes) {
      return std::optional<std::vector<BlockKey>>();
    }
  }
  return std::optional<std::vector<BlockKey>>(std::move(blocks));
}

}  // namespace

Result<double> choose_voxel_size(std::span<const DenseView> views,
                                 const DepthMapSource& depth_maps,
                                 const SurfaceOptions& options) {
  if (options.voxel_size > 0.0) {
    return options.voxel_size;
  }
  std::vector<float> footprints;
  for (std::size_t view = 0; view < views.size(); ++view) {
    TM_ASSIGN_OR_RETURN(const DepthMap map, depth_maps.load(view));
    append_footprints(map, footprints);
  }
  if (footprints.empty()) {
    return fail(ErrorCode::kInsufficientData,
                "cannot make a surface: none of {} views has a depth map with known depths",
                views.size());
  }
  const auto middle = footprints.begin() + static_cast<std::ptrdiff_t>(footprints.size() / 2);
  std::nth_element(footprints.begin(), middle, footprints.end());
  return options.voxel_footprint_ratio * static_cast<double>(*middle);
}

Result<VoxelGrid> fuse_depth_maps(std::span<const DenseView> views,
                                  const DepthMapSource& depth_maps,
                                  const SurfaceOptions& options,
                                  SurfaceReport& report,
                                  Executor& executor) {
  TM_ASSIGN_OR_RETURN(report.wanted_voxel_size, choose_voxel_size(views, depth_maps, options));
  report.voxel_size = report.wanted_voxel_size;
  std::optional<std::vector<BlockKey>> blocks;
  while (true) {
    TM_ASSIGN_OR_RETURN(blocks, find_blocks(views, depth_maps, options, report.voxel_size));
    if (blocks) {
      break;
    }
    report.voxel_size *= kVoxelGrowthRatio;
    ++report.memory_steps;
  }
  VoxelGrid grid(report.voxel_size, *std::move(blocks));
  report.block_count = grid.size();
  report.grid_bytes = grid.size() * sizeof(VoxelBlock);
  const TsdfOptions tsdf{
      .truncation = static_cast<float>(options.truncation_voxels * report.voxel_size),
      .free_space_weight_ratio = static_cast<float>(options.free_space_weight_ratio)};
  const std::size_t tasks = (grid.size() + kBlocksPerTask - 1) / kBlocksPerTask;
  for (std::size_t view = 0; view < views.size(); ++view) {
    TM_ASSIGN_OR_RETURN(const DepthMap map, depth_maps.load(view));
    TM_ASSIGN_OR_RETURN(const DepthFrame frame,
                        make_depth_frame(map,
                                         views[view].cam_from_world,
                                         frame_options(options, report.voxel_size)));
    if (frame.planes.empty()) {
      continue;
    }
    ++report.view_count;
    executor.for_each_index(tasks, [&](std::size_t task) {
      const std::size_t end = std::min((task + 1) * kBlocksPerTask, grid.size());
      for (std::size_t block = task * kBlocksPerTask; block < end; ++block) {
        integrate(frame, tsdf, grid, block);
      }
    });
  }
  return grid;
}

}  // namespace trigmesh
