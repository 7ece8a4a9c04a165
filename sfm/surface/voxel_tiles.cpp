#include "sfm/surface/voxel_tiles.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "firmware/base/check.hpp"

namespace trigmesh {

namespace {

constexpr std::size_t kFewestBlocks = 27;
// Rounding may move a voxel across the border of a picture by less than this, pixels.
constexpr double kMarginPx = 2.0;

using Indices = std::vector<std::uint32_t>;

/// The blocks and those around them.
std::vector<BlockKey> with_neighbors(std::span<const BlockKey> keys, const Indices& blocks) {
  std::vector<std::uint8_t> wanted(keys.size(), 0);
  for (const std::uint32_t block : blocks) {
    for (const std::size_t near : blocks_around(keys, keys[block])) {
      if (near != kNoBlock) {
        wanted[near] = 1;
      }
    }
  }
  std::vector<BlockKey> all;
  for (std::size_t block = 0; block < keys.size(); ++block) {
    if (wanted[block] != 0) {
      all.push_back(keys[block]);
    }
  }
  return all;
}

struct BlockBox {
  Eigen::Vector3i low;
  Eigen::Vector3i high;  ///< inclusive
};

template <typename Keys>
BlockBox box_of(const Keys& keys) {
  BlockBox box{block_position(*keys.begin()), block_position(*keys.begin())};
  for (const BlockKey key : keys) {
    box.low = box.low.cwiseMin(block_position(key));
    box.high = box.high.cwiseMax(block_position(key));
  }
  return box;
}

/// Both halves of the blocks along the longest side of their box, each in order.
std::pair<Indices, Indices> halve(std::span<const BlockKey> keys, Indices blocks) {
  std::vector<BlockKey> own;
  own.reserve(blocks.size());
  for (const std::uint32_t block : blocks) {
    own.push_back(keys[block]);
  }
  const BlockBox box = box_of(own);
  Eigen::Index axis = 0;
  (box.high - box.low).maxCoeff(&axis);
  const auto middle = blocks.begin() + static_cast<std::ptrdiff_t>(blocks.size() / 2);
  std::nth_element(blocks.begin(), middle, blocks.end(), [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(block_position(keys[a])[axis], a) <
           std::pair(block_position(keys[b])[axis], b);
  });
  Indices second(middle, blocks.end());
  blocks.erase(middle, blocks.end());
  std::sort(blocks.begin(), blocks.end());
  std::sort(second.begin(), second.end());
  return {std::move(blocks), std::move(second)};
}

}  // namespace

std::vector<VoxelTile> make_tiles(std::span<const BlockKey> keys, std::size_t max_blocks) {
  TM_CHECK(max_blocks >= kFewestBlocks);
  std::vector<VoxelTile> tiles;
  if (keys.empty()) {
    return tiles;
  }
  std::vector<Indices> open(1, Indices(keys.size()));
  std::iota(open[0].begin(), open[0].end(), 0U);
  while (!open.empty()) {
    Indices blocks = std::move(open.back());
    open.pop_back();
    std::vector<BlockKey> all =
        blocks.size() <= max_blocks ? with_neighbors(keys, blocks) : std::vector<BlockKey>();
    if (blocks.size() <= max_blocks && all.size() <= max_blocks) {
      tiles.push_back({std::move(blocks), std::move(all)});
      continue;
    }
    auto [first, second] = halve(keys, std::move(blocks));
    open.push_back(std::move(second));
    open.push_back(std::move(first));
  }
  return tiles;
}

bool may_reach(const ViewReach& view, const VoxelTile& tile, double voxel_size) {
  const BlockBox box = box_of(tile.keys);
  // For each side of the frustum, beyond the farthest depth and behind the camera: whether a corner
  // of the box is not outside.
  std::array<bool, 6> any_inside{};
  for (int c = 0; c < 8; ++c) {
    const Eigen::Vector3i corner((c & 1) != 0 ? box.high.x() + 1 : box.low.x(),
                                 (c & 2) != 0 ? box.high.y() + 1 : box.low.y(),
                                 (c & 4) != 0 ? box.high.z() + 1 : box.low.z());
    const Eigen::Vector3d p =
        view.cam_from_world * (corner.cast<double>() * (kBlockEdge * voxel_size));
    const Camera& camera = view.camera;
    const std::array<double, 6> inside = {
        camera.fx_px * p.x() + (camera.cx_px + kMarginPx) * p.z(),
        (camera.width_px + kMarginPx - camera.cx_px) * p.z() - camera.fx_px * p.x(),
        camera.fy_px * p.y() + (camera.cy_px + kMarginPx) * p.z(),
        (camera.height_px + kMarginPx - camera.cy_px) * p.z() - camera.fy_px * p.y(),
        p.z() + voxel_size,
        view.max_depth + kBlockEdge * voxel_size - p.z()};
    for (std::size_t side = 0; side < inside.size(); ++side) {
      any_inside[side] = any_inside[side] || inside[side] >= 0.0;
    }
  }
  return view.max_depth > 0.0 &&
         std::all_of(any_inside.begin(), any_inside.end(), [](bool any) { return any; });
}

}  // namespace trigmesh
