#include "sfm/surface/tsdf_integration.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace trigmesh {

namespace {

// Pixels of a view that must touch a block before it counts as near a surface.
constexpr std::size_t kMinTouches = 3;
// Coordinates beyond this many blocks do not fit a key.
constexpr float kMaxBlocks = 1.0e6F;

/// Pixels of a frame that a ball may touch, [first, last], empty when last < first.
struct PixelWindow {
  int first_x = 0;
  int last_x = -1;
  int first_y = 0;
  int last_y = -1;
  bool everything = false;  ///< the ball is too near to the camera to tell
};

PixelWindow window_of_ball(const DepthFrame& frame, const Eigen::Vector3f& center, float radius) {
  PixelWindow window;
  if (center.z() <= -radius) {
    return window;
  }
  if (center.z() <= 2.0F * radius) {
    window.everything = true;
    return window;
  }
  const float near = center.z() - radius;
  const auto bounds = [&](float focal, float offset, float coordinate, int size) {
    const float low = focal * std::min((coordinate - radius) / near,
                                       (coordinate - radius) / (center.z() + radius)) +
                      offset;
    const float high = focal * std::max((coordinate + radius) / near,
                                        (coordinate + radius) / (center.z() + radius)) +
                       offset;
    const auto limit = static_cast<float>(size);
    return std::pair<int, int>(static_cast<int>(std::clamp(std::floor(low), 0.0F, limit)),
                               static_cast<int>(std::clamp(std::ceil(high), -1.0F, limit - 1.0F)));
  };
  std::tie(window.first_x, window.last_x) =
      bounds(frame.fx_px, frame.cx_px, center.x(), frame.width_px);
  std::tie(window.first_y, window.last_y) =
      bounds(frame.fy_px, frame.cy_px, center.y(), frame.height_px);
  return window;
}

/// Whether the block can hear anything from the view: some pixel in its window has a surface that
/// is not far in front of it.
bool may_see(const DepthFrame& frame, const Eigen::Vector3f& center, float radius, float reach) {
  const PixelWindow window = window_of_ball(frame, center, radius);
  if (window.everything) {
    return true;
  }
  const float nearest = center.z() - radius - reach;
  for (int y = window.first_y; y <= window.last_y; ++y) {
    const PixelPlane* row = frame.planes.data() + static_cast<std::ptrdiff_t>(y) * frame.width_px;
    for (int x = window.first_x; x <= window.last_x; ++x) {
      if (row[x].depth > 0.0F && row[x].depth >= nearest) {
        return true;
      }
    }
  }
  return false;
}

/// Signed distance in truncation distances and its weight; weight 0 = nothing is said.
struct Vote {
  float distance = 0.0F;
  float weight = 0.0F;
};

inline Vote vote_of(const PixelPlane& plane,
                    const Eigen::Vector3f& point_in_cam,
                    const TsdfOptions& options) {
  const float distance = (plane.normal.dot(point_in_cam) - plane.offset) / options.truncation;
  if (distance >= 1.0F) {
    const bool seen_through = point_in_cam.z() <= plane.free_depth - options.truncation;
    return {1.0F, seen_through ? plane.weight * options.free_space_weight_ratio : 0.0F};
  }
  if (distance >= 0.0F) {
    return {distance, plane.weight};
  }
  // Behind the surface the weight falls from one to zero over the truncation distance.
  const bool hidden =
      distance <= -1.0F || point_in_cam.z() - plane.depth > kMaxRayTruncations * options.truncation;
  return {distance, hidden ? 0.0F : plane.weight * (1.0F + distance)};
}

}  // namespace

std::vector<BlockKey> blocks_near_surface(const DepthFrame& frame,
                                          double voxel_size,
                                          double truncation) {
  const auto block_size = static_cast<float>(voxel_size * kBlockEdge);
  const auto reach = static_cast<float>(truncation);
  const int steps = static_cast<int>(std::ceil(4.0F * reach / block_size)) + 1;
  const Eigen::Matrix3f world_from_cam = frame.rotation_cam_from_world.transpose();
  std::vector<BlockKey> touched;
  for (std::size_t i = 0; i < frame.planes.size(); ++i) {
    const PixelPlane& plane = frame.planes[i];
    if (plane.depth <= 0.0F) {
      continue;
    }
    const auto x = static_cast<float>(i % static_cast<std::size_t>(frame.width_px));
    const auto y = static_cast<float>(i / static_cast<std::size_t>(frame.width_px));
    const Eigen::Vector3f in_cam((x - frame.cx_px) / frame.fx_px * plane.depth,
                                 (y - frame.cy_px) / frame.fy_px * plane.depth,
                                 plane.depth);
    for (int s = 0; s < steps; ++s) {
      const float along =
          reach * (2.0F * static_cast<float>(s) / static_cast<float>(steps - 1) - 1.0F);
      const Eigen::Vector3f in_blocks =
          world_from_cam * (in_cam + along * plane.normal - frame.translation_cam_from_world) /
          block_size;
      if (!(in_blocks.cwiseAbs().maxCoeff() < kMaxBlocks)) {
        continue;
      }
      const auto key = block_key(in_blocks.array().floor().matrix().cast<int>());
      if (key && (touched.empty() || touched.back() != *key)) {
        touched.push_back(*key);
      }
    }
  }
  std::sort(touched.begin(), touched.end());
  std::vector<BlockKey> blocks;
  for (std::size_t i = 0; i + kMinTouches <= touched.size(); ++i) {
    const bool enough = touched[i] == touched[i + kMinTouches - 1];
    if (enough && (blocks.empty() || blocks.back() != touched[i])) {
      blocks.push_back(touched[i]);
    }
  }
  return blocks;
}

void integrate(const DepthFrame& frame,
               const TsdfOptions& options,
               VoxelGrid& grid,
               std::size_t block) {
  const auto voxel = static_cast<float>(grid.voxel_size());
  const Eigen::Vector3f corner =
      block_position(grid.key(block)).cast<float>() * (voxel * static_cast<float>(kBlockEdge));
  const Eigen::Vector3f corner_in_cam = frame.to_camera(corner);
  const Eigen::Matrix3f step = frame.rotation_cam_from_world * voxel;
  const float half = 0.5F * static_cast<float>(kBlockEdge - 1);
  const Eigen::Vector3f center = corner_in_cam + step * Eigen::Vector3f::Constant(half);
  const float radius = half * voxel * std::sqrt(3.0F);
  if (!may_see(frame, center, radius, kMaxRayTruncations * options.truncation)) {
    return;
  }
  VoxelBlock& voxels = grid.block(block);
  std::size_t i = 0;
  for (int z = 0; z < kBlockEdge; ++z) {
    for (int y = 0; y < kBlockEdge; ++y) {
      const Eigen::Vector3f row =
          corner_in_cam + step.col(1) * static_cast<float>(y) + step.col(2) * static_cast<float>(z);
      for (int x = 0; x < kBlockEdge; ++x, ++i) {
        const Eigen::Vector3f point = row + step.col(0) * static_cast<float>(x);
        const PixelPlane* plane = frame.find_plane(point);
        if (plane == nullptr) {
          continue;
        }
        const Vote vote = vote_of(*plane, point, options);
        if (vote.weight > 0.0F) {
          const float sum = voxels.weight[i] + vote.weight;
          voxels.distance[i] += (vote.distance - voxels.distance[i]) * (vote.weight / sum);
          voxels.weight[i] = sum;
        }
      }
    }
  }
}

}  // namespace trigmesh
