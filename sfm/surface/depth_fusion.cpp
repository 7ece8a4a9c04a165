#include "sfm/surface/depth_fusion.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include "firmware/base/check.hpp"
#include "sfm/surface/depth_frame.hpp"
#include "sfm/surface/marching_cubes.hpp"
#include "sfm/surface/tsdf_integration.hpp"
#include "sfm/surface/voxel_tiles.hpp"

namespace trigmesh {

namespace {

// Every so many rows and columns one pixel is looked at for the footprint.
constexpr int kFootprintStride = 7;
// Blocks that one piece of parallel work integrates.
constexpr std::size_t kBlocksPerTask = 64;
// As measured on synth_A_orbit: faces per block near a surface (27 to 36); bytes of a block's
// surface until all are joined; bytes per face, with its half of a vertex, while the mesh is
// simplified.
constexpr std::size_t kExpectedFacesPerBlock = 28;
constexpr std::size_t kSurfaceBytesPerBlock = 850;
constexpr std::size_t kMeshBytesPerFace = 150;
// Smaller tiles would be mostly blocks of their neighbours.
constexpr std::size_t kFewestTileBlocks = 512;

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

/// What stays the same for one size of voxels.
struct FusionInput {
  std::span<const DenseView> views;
  const DepthMapSource& depth_maps;
  const SurfaceOptions& options;
  double voxel_size;

  [[nodiscard]] double truncation() const { return options.truncation_voxels * voxel_size; }

  [[nodiscard]] Result<DepthFrame> load(std::size_t view) const {
    TM_ASSIGN_OR_RETURN(const DepthMap map, depth_maps.load(view));
    return make_depth_frame(
        map,
        views[view].cam_from_world,
        {.voxel_size = static_cast<float>(voxel_size),
         .max_footprint_voxels = static_cast<float>(options.max_footprint_voxels)});
  }
};

/// Where there is something to do: blocks near any surface, and how far each view reaches.
struct FusionSite {
  std::vector<BlockKey> blocks;
  std::vector<ViewReach> reaches;
};

ViewReach reach_of(const DepthFrame& frame, const Rigid3& cam_from_world, double truncation) {
  ViewReach reach;
  reach.camera = {.model = CameraModel::kPinhole,
                  .width_px = frame.width_px,
                  .height_px = frame.height_px,
                  .fx_px = static_cast<double>(frame.fx_px),
                  .fy_px = static_cast<double>(frame.fy_px),
                  .cx_px = static_cast<double>(frame.cx_px),
                  .cy_px = static_cast<double>(frame.cy_px)};
  reach.cam_from_world = cam_from_world;
  float farthest = 0.0F;
  for (const PixelPlane& plane : frame.planes) {
    farthest = std::max(farthest, plane.depth);
  }
  if (farthest > 0.0F) {
    reach.max_depth =
        static_cast<double>(farthest) + static_cast<double>(kMaxRayTruncations) * truncation;
  }
  return reach;
}

/// Nothing when so many blocks are found that their surface would not fit.
Result<std::optional<FusionSite>> survey(const FusionInput& input) {
  FusionSite site;
  for (std::size_t view = 0; view < input.views.size(); ++view) {
    TM_ASSIGN_OR_RETURN(const DepthFrame frame, input.load(view));
    site.reaches.push_back(reach_of(frame, input.views[view].cam_from_world, input.truncation()));
    site.blocks =
        merge(site.blocks, blocks_near_surface(frame, input.voxel_size, input.truncation()));
    if (site.blocks.size() * kExpectedFacesPerBlock * kMeshBytesPerFace >
        input.options.max_memory_bytes) {
      return std::optional<FusionSite>();
    }
  }
  return std::optional<FusionSite>(std::move(site));
}

/// Blocks, own and around, that a tile may have beside the surfaces of all others.
std::size_t tile_capacity(std::size_t block_count, const SurfaceOptions& options) {
  const std::size_t surfaces = block_count * kSurfaceBytesPerBlock;
  const std::size_t left =
      options.max_memory_bytes > surfaces ? options.max_memory_bytes - surfaces : 0;
  return std::max(kFewestTileBlocks,
                  std::min(left, options.max_tile_bytes) / VoxelGrid::kBytesPerBlock);
}

void for_each_block(std::size_t count,
                    Executor& executor,
                    const std::function<void(std::size_t)>& work) {
  executor.for_each_index((count + kBlocksPerTask - 1) / kBlocksPerTask, [&](std::size_t task) {
    const std::size_t end = std::min((task + 1) * kBlocksPerTask, count);
    for (std::size_t block = task * kBlocksPerTask; block < end; ++block) {
      work(block);
    }
  });
}

/// The distance function in one tile, from the views that reach it.
Result<VoxelGrid> integrate_tile(const FusionInput& input,
                                 const std::vector<ViewReach>& reaches,
                                 const VoxelTile& tile,
                                 Executor& executor) {
  VoxelGrid grid(input.voxel_size, tile.keys);
  const TsdfOptions tsdf{
      .truncation = static_cast<float>(input.truncation()),
      .free_space_weight_ratio = static_cast<float>(input.options.free_space_weight_ratio)};
  for (std::size_t view = 0; view < input.views.size(); ++view) {
    if (may_reach(reaches[view], tile, input.voxel_size)) {
      TM_ASSIGN_OR_RETURN(const DepthFrame frame, input.load(view));
      for_each_block(
          grid.size(), executor, [&](std::size_t block) { integrate(frame, tsdf, grid, block); });
    }
  }
  return grid;
}

/// The surface in all blocks, tile by tile; nothing when it has more faces than fit.
Result<std::optional<std::vector<BlockSurface>>> extract_tiles(const FusionInput& input,
                                                               const FusionSite& site,
                                                               SurfaceReport& report,
                                                               Executor& executor) {
  const std::vector<VoxelTile> tiles =
      make_tiles(site.blocks, tile_capacity(site.blocks.size(), input.options));
  report.tile_count = tiles.size();
  std::vector<BlockSurface> surfaces(site.blocks.size());
  std::size_t faces = 0;
  for (const VoxelTile& tile : tiles) {
    TM_ASSIGN_OR_RETURN(const VoxelGrid grid, integrate_tile(input, site.reaches, tile, executor));
    report.grid_bytes = std::max(report.grid_bytes, grid.size() * sizeof(VoxelBlock));
    for_each_block(tile.blocks.size(), executor, [&](std::size_t k) {
      const std::size_t block = tile.blocks[k];
      surfaces[block] = extract_block(grid,
                                      find_block(grid.keys(), block_position(site.blocks[block])),
                                      static_cast<float>(input.options.min_voxel_weight));
    });
    for (const std::uint32_t block : tile.blocks) {
      faces += surfaces[block].faces.size();
    }
    if (faces * kMeshBytesPerFace > input.options.max_memory_bytes) {
      return std::optional<std::vector<BlockSurface>>();
    }
  }
  return std::optional<std::vector<BlockSurface>>(std::move(surfaces));
}

/// The mesh with voxels of this size; nothing when it would not fit.
Result<std::optional<TriangleMesh>> fuse(const FusionInput& input,
                                         SurfaceReport& report,
                                         Executor& executor) {
  TM_ASSIGN_OR_RETURN(const std::optional<FusionSite> site, survey(input));
  if (!site) {
    return std::optional<TriangleMesh>();
  }
  report.block_count = site->blocks.size();
  report.view_count = static_cast<std::size_t>(
      std::count_if(site->reaches.begin(), site->reaches.end(), [](const ViewReach& reach) {
        return reach.camera.width_px > 0;
      }));
  TM_ASSIGN_OR_RETURN(std::optional<std::vector<BlockSurface>> surfaces,
                      extract_tiles(input, *site, report, executor));
  if (!surfaces) {
    return std::optional<TriangleMesh>();
  }
  return std::optional<TriangleMesh>(join_blocks(site->blocks, *std::move(surfaces), executor));
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

Result<TriangleMesh> fuse_depth_maps(std::span<const DenseView> views,
                                     const DepthMapSource& depth_maps,
                                     const SurfaceOptions& options,
                                     SurfaceReport& report,
                                     Executor& executor) {
  TM_ASSIGN_OR_RETURN(report.wanted_voxel_size, choose_voxel_size(views, depth_maps, options));
  report.voxel_size = report.wanted_voxel_size;
  while (true) {
    TM_ASSIGN_OR_RETURN(std::optional<TriangleMesh> mesh,
                        fuse({views, depth_maps, options, report.voxel_size}, report, executor));
    if (mesh) {
      return *std::move(mesh);
    }
    report.voxel_size *= kVoxelGrowthRatio;
    ++report.memory_steps;
  }
}

}  // namespace trigmesh
