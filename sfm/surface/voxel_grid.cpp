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
// Vertices, faces and edge lists of a block that the surface crosses, averaged over all blocks.
constexpr std::size_t kExtractionBytesPerBlock = 3500;

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

VoxelGrid::VoxelGrid(double voxel_size, std::vector<BlockKey> keys)
    : voxel_size_(voxel_size), keys_(std::move(keys)), blocks_(keys_.size()) {
  TM_CHECK(voxel_size > 0.0);
  TM_CHECK(std::adjacent_find(keys_.begin(), keys_.end(), std::greater_equal<>()) == keys_.end());
}

std::size_t VoxelGrid::find(const Eigen::Vector3i& position) const {
  const auto key = block_key(position);
  if (!key) {
    return kNone;
  }
  const auto place = std::lower_bound(keys_.begin(), keys_.end(), *key);
  return place != keys_.end() && *place == *key ? static_cast<std::size_t>(place - keys_.begin())
                                                : kNone;
}

std::array<std::size_t, 27> VoxelGrid::neighborhood(std::size_t block) const {
  std::array<std::size_t, 27> around{};
  const Eigen::Vector3i center = block_position(keys_[block]);
  for (std::size_t i = 0; i < around.size(); ++i) {
    const Eigen::Vector3i offset(static_cast<int>(i % 3) - 1,
                                 static_cast<int>(i / 3 % 3) - 1,
                                 static_cast<int>(i / 9) - 1);
    around[i] = find(center + offset);
  }
  return around;
}

std::size_t VoxelGrid::estimated_bytes(std::size_t block_count) {
  return block_count * (sizeof(VoxelBlock) + sizeof(BlockKey) + kExtractionBytesPerBlock);
}

}  // namespace trigmesh
