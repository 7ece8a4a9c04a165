#include "sfm/surface/voxel_grid.hpp"

#include <algorithm>
#include <functional>
#include <utility>

#include "firmware/base/check.hpp"

namespace trigmesh {

namespace {

constexpr int kCoordinateBits = 21;
constexpr int kCoordinateOffset = 1 << 20;
constexpr std::uint64_t kCoordinateMask = (std::uint64_t{1} << kCoordinateBits) - 1U;

}  // namespace

std::optional<BlockKey> block_key(const Eigen::Vector3i& block) {
  std::uint64_t key = 0;
  for (int axis = 2; axis >= 0; --axis) {
    if (block[axis] < -kCoordinateOffset || block[axis] >= kCoordinateOffset) {
      return std::nullopt;
    }
    key = (key << kCoordinateBits) | static_cast<std::uint64_t>(block[axis] + kCoordinateOffset);
  }
  return BlockKey{key};
}

Eigen::Vector3i block_position(BlockKey key) {
  const auto bits = static_cast<std::uint64_t>(key);
  const auto coordinate = [&](int axis) {
    return static_cast<int>((bits >> (axis * kCoordinateBits)) & kCoordinateMask) -
           kCoordinateOffset;
  };
  return {coordinate(0), coordinate(1), coordinate(2)};
}

std::size_t find_block(std::span<const BlockKey> keys, const Eigen::Vector3i& position) {
  const auto key = block_key(position);
  if (!key) {
    return kNoBlock;
  }
  const auto place = std::lower_bound(keys.begin(), keys.end(), *key);
  return place != keys.end() && *place == *key ? static_cast<std::size_t>(place - keys.begin())
                                               : kNoBlock;
}

std::array<std::size_t, 27> blocks_around(std::span<const BlockKey> keys, BlockKey center) {
  std::array<std::size_t, 27> around{};
  const Eigen::Vector3i position = block_position(center);
  for (std::size_t i = 0; i < around.size(); ++i) {
    const Eigen::Vector3i offset(
        static_cast<int>(i % 3) - 1, static_cast<int>(i / 3 % 3) - 1, static_cast<int>(i / 9) - 1);
    around[i] = find_block(keys, position + offset);
  }
  return around;
}

VoxelGrid::VoxelGrid(double voxel_size, std::vector<BlockKey> keys)
    : voxel_size_(voxel_size), keys_(std::move(keys)), blocks_(keys_.size()) {
  TM_CHECK(voxel_size > 0.0);
  TM_CHECK(std::adjacent_find(keys_.begin(), keys_.end(), std::greater_equal<>()) == keys_.end());
}

}  // namespace trigmesh
