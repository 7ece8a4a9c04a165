#include "firmware/pipeline/surface_plan.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "firmware/base/check.hpp"

namespace trigmesh {

namespace {

// Program, libraries, sparse scene.
constexpr std::uint64_t kBaseBytes = 150'000'000;
// A depth map in memory: depth, normal, confidence.
constexpr std::uint64_t kBytesPerMapPixel = 17;
// The decoded picture, its undistorted twin and the encoded file.
constexpr std::uint64_t kBytesPerPicturePixel = 8;
// Points of the dense cloud, with the PLY that is written of them.
constexpr std::uint64_t kBytesPerPoint = 80;
// Of the pixels of all maps about one in four becomes a point: the others are merged or dropped.
constexpr std::uint64_t kMapPixelsPerPoint = 4;
constexpr std::uint64_t kBytesPerFace = 400;
// A picture that is searched for what moved: colours, depth, mask, evidence; and its keypoints. One
// picture at a time for each thread is also a graph.
constexpr std::uint64_t kBytesPerSearchPixel = 12;
constexpr std::uint64_t kBytesPerSearchView = 1'000'000;
constexpr std::uint64_t kBytesPerGraphPixel = 400;
constexpr std::uint64_t kGraphs = 4;
constexpr int kSearchSidePx = 480;
constexpr int kSmallestSidePx = 160;
constexpr double kScaleStep = 0.75;
// The first round of stereo works at half the size of the maps, but not below this side.
constexpr double kSmallestFirstRoundSidePx = 640.0;
// Voxels of a tile and mesh of the surface when no limit asks for less.
constexpr std::size_t kSurfaceBudget = std::size_t{1200} << 20U;
constexpr std::size_t kSmallestSurfaceBudget = std::size_t{64} << 20U;

struct PresetSizes {
  double map_scale;
  int smallest_side_px;  ///< longer sides are not reduced below this
  int largest_side_px;
  std::size_t max_faces;
};

PresetSizes sizes_of(QualityPreset preset) {
  switch (preset) {
    case QualityPreset::kPreview:
      return {0.5, 320, 640, 60'000};
    case QualityPreset::kStandard:
      return {0.5, 640, 1600, 300'000};
    case QualityPreset::kFine:
      break;
  }
  return {1.0, 640, 1600, 1'000'000};
}

int longest_side(std::span<const DenseView> views) {
  int side = 1;
  for (const DenseView& view : views) {
    side = std::max({side, view.camera.width_px, view.camera.height_px});
  }
  return side;
}

double wanted_scale(std::span<const DenseView> views, QualityPreset preset) {
  const PresetSizes sizes = sizes_of(preset);
  const double full = longest_side(views);
  const double side = std::clamp(sizes.map_scale * full,
                                 std::min(full, static_cast<double>(sizes.smallest_side_px)),
                                 static_cast<double>(sizes.largest_side_px));
  return side / full;
}

double first_round_scale(std::span<const DenseView> views, double map_scale) {
  const double side = std::max(1.0, longest_side(views) * map_scale);
  return std::clamp(kSmallestFirstRoundSidePx / side, 0.5, 1.0);
}

struct PixelCounts {
  std::uint64_t largest_picture = 0;
  std::uint64_t largest_map = 0;
  std::uint64_t all_maps = 0;
};

PixelCounts count_pixels(std::span<const DenseView> views, double scale) {
  PixelCounts counts;
  for (const DenseView& view : views) {
    const auto picture = static_cast<std::uint64_t>(view.camera.width_px) *
                         static_cast<std::uint64_t>(view.camera.height_px);
    const auto map = static_cast<std::uint64_t>(scaled_side(view.camera.width_px, scale)) *
                     static_cast<std::uint64_t>(scaled_side(view.camera.height_px, scale));
    counts.largest_picture = std::max(counts.largest_picture, picture);
    counts.largest_map = std::max(counts.largest_map, map);
    counts.all_maps += map;
  }
  return counts;
}

std::uint64_t dense_bytes(std::span<const DenseView> views, const SurfacePlan& plan) {
  const PixelCounts pixels = count_pixels(views, plan.map_scale);
  int width = 1;
  int height = 1;
  for (const DenseView& view : views) {
    width = std::max(width, scaled_side(view.camera.width_px, plan.map_scale));
    height = std::max(height, scaled_side(view.camera.height_px, plan.map_scale));
  }
  const std::uint64_t sources = plan.selection.max_sources;
  const std::uint64_t stereo = estimate_memory_bytes(width, height, sources) +
                               (sources + 2) * pixels.largest_map * kBytesPerMapPixel;
  const std::uint64_t cloud = pixels.all_maps / kMapPixelsPerPoint * kBytesPerPoint;
  // Two grey-sized planes of every map stay in memory: picture and mask.
  return kBaseBytes + 2 * pixels.all_maps + pixels.largest_picture * kBytesPerPicturePixel +
         std::max(stereo, cloud);
}

std::uint64_t mesh_bytes(const SurfacePlan& plan) {
  return kBaseBytes + plan.surface.max_memory_bytes;
}

std::uint64_t texture_bytes(std::span<const DenseView> views, const SurfacePlan& plan) {
  const auto page = static_cast<std::uint64_t>(plan.texture.atlas.page_size_px);
  const auto pages = static_cast<std::uint64_t>(plan.texture.atlas.max_pages);
  return kBaseBytes + plan.surface.max_faces * kBytesPerFace + 4 * page * page * pages +
         count_pixels(views, 1.0).largest_picture * 2 * kBytesPerPicturePixel;
}

Result<> shrink_maps(std::span<const DenseView> views, std::uint64_t limit, SurfacePlan& plan) {
  const double wanted = plan.map_scale;
  const int full = longest_side(views);
  while (dense_bytes(views, plan) > limit &&
         scaled_side(full, plan.map_scale * kScaleStep) >= kSmallestSidePx) {
    plan.map_scale *= kScaleStep;
  }
  if (dense_bytes(views, plan) > limit) {
    return fail(ErrorCode::kLimitExceeded,
                "cannot make depth maps of {} views within {} MB: at least {} MB are needed; raise "
                "--memory-limit or use fewer or smaller photographs",
                views.size(),
                limit / 1'000'000,
                dense_bytes(views, plan) / 1'000'000 + 1);
  }
  if (plan.map_scale != wanted) {
    plan.lowered.push_back(
        fmt::format("to keep the memory limit, depth maps were made {} instead of {} pixels wide",
                    scaled_side(full, plan.map_scale),
                    scaled_side(full, wanted)));
  }
  return {};
}

std::uint64_t moving_bytes(std::span<const DenseView> views, int side_px) {
  const double scale = std::min(1.0, static_cast<double>(side_px) / longest_side(views));
  const PixelCounts pixels = count_pixels(views, scale);
  return kBaseBytes + pixels.all_maps * kBytesPerSearchPixel + views.size() * kBytesPerSearchView +
         kGraphs * pixels.largest_map * kBytesPerGraphPixel;
}

/// Searches smaller pictures, or none at all.
void shrink_search(std::span<const DenseView> views, std::uint64_t limit, SurfacePlan& plan) {
  const int wanted = plan.moving_side_px;
  while (plan.moving_side_px >= kSmallestSidePx &&
         moving_bytes(views, plan.moving_side_px) > limit) {
    plan.moving_side_px = static_cast<int>(std::lround(plan.moving_side_px * kScaleStep));
  }
  if (plan.moving_side_px < std::min(wanted, kSmallestSidePx)) {
    plan.moving_side_px = 0;
    plan.lowered.emplace_back(
        "to keep the memory limit, things that moved were not looked for; a mask for each "
        "photograph leaves them out");
  } else if (plan.moving_side_px != wanted) {
    plan.lowered.push_back(fmt::format(
        "to keep the memory limit, things that moved were looked for in pictures {} instead of {} "
        "pixels wide",
        plan.moving_side_px,
        wanted));
  }
}

Result<> shrink_texture(std::span<const DenseView> views, std::uint64_t limit, SurfacePlan& plan) {
  AtlasOptions& atlas = plan.texture.atlas;
  const int wanted_pages = atlas.max_pages;
  const int wanted_side = atlas.page_size_px;
  while (texture_bytes(views, plan) > limit && atlas.max_pages > 1) {
    --atlas.max_pages;
  }
  while (texture_bytes(views, plan) > limit && atlas.page_size_px > 512) {
    atlas.page_size_px /= 2;
  }
  if (texture_bytes(views, plan) > limit) {
    return fail(
        ErrorCode::kLimitExceeded,
        "cannot make a texture within {} MB: at least {} MB are needed; raise --memory-limit",
        limit / 1'000'000,
        texture_bytes(views, plan) / 1'000'000 + 1);
  }
  if (atlas.max_pages != wanted_pages || atlas.page_size_px != wanted_side) {
    plan.lowered.push_back(
        fmt::format("to keep the memory limit, the texture has at most {} pages of {} pixels "
                    "instead of {} of {}",
                    atlas.max_pages,
                    atlas.page_size_px,
                    wanted_pages,
                    wanted_side));
  }
  return {};
}

}  // namespace

int scaled_side(int side_px, double scale) {
  return std::max(1, static_cast<int>(std::lround(side_px * scale)));
}

Result<SurfacePlan> plan_surface(std::span<const DenseView> views,
                                 const BuildOptions& options,
                                 std::uint64_t limit_bytes) {
  TM_RETURN_IF_ERROR(options.validate());
  SurfacePlan plan;
  plan.map_scale =
      options.map_side_px > 0
          ? std::min(1.0, static_cast<double>(options.map_side_px) / longest_side(views))
          : wanted_scale(views, options.preset);
  plan.surface.max_faces = options.max_faces > 0 ? static_cast<std::size_t>(options.max_faces)
                                                 : sizes_of(options.preset).max_faces;
  plan.surface.max_memory_bytes = kSurfaceBudget;
  plan.moving_side_px = options.moving == MovingUse::kAuto ? kSearchSidePx : 0;
  plan.texture.atlas.page_size_px = options.texture_size_px;
  if (limit_bytes != 0 && options.preset != QualityPreset::kPreview) {
    TM_RETURN_IF_ERROR(shrink_maps(views, limit_bytes, plan));
    shrink_search(views, limit_bytes, plan);
  }
  plan.first_round_scale = first_round_scale(views, plan.map_scale);
  if (limit_bytes == 0) {
    return plan;
  }
  if (options.last_stage >= LastStage::kMesh && mesh_bytes(plan) > limit_bytes) {
    // The surface stage works in smaller tiles; it makes its voxels larger only when the mesh
    // itself would not fit, and says so.
    const std::uint64_t left = limit_bytes > kBaseBytes ? limit_bytes - kBaseBytes : 0;
    plan.surface.max_memory_bytes =
        std::max(kSmallestSurfaceBudget, static_cast<std::size_t>(left));
    if (mesh_bytes(plan) > limit_bytes) {
      return fail(
          ErrorCode::kLimitExceeded,
          "cannot make a surface within {} MB: at least {} MB are needed; raise --memory-limit",
          limit_bytes / 1'000'000,
          mesh_bytes(plan) / 1'000'000 + 1);
    }
  }
  if (options.last_stage == LastStage::kTexture) {
    TM_RETURN_IF_ERROR(shrink_texture(views, limit_bytes, plan));
  }
  return plan;
}

}  // namespace trigmesh
