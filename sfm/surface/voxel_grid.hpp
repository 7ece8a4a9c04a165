#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace trigmesh {

/// Voxels along an edge of a block.
inline constexpr int kBlockEdge = 8;
inline constexpr std::size_t kBlockVoxels = 512;

/// Integer position of a block, packed so that keys sort by z, then y, then x.
enum class BlockKey : std::uint64_t {};

/// Block coordinates must be within +-2^20; others give nothing.
[[nodiscard]] std::optional<BlockKey> block_key(const Eigen::Vector3i& block);
[[nodiscard]] Eigen::Vector3i block_position(BlockKey key);

/// Signed distances of 8x8x8 voxels; voxel (x, y, z) is element x + 8 y + 64 z.
struct VoxelBlock {
  std::array<float, kBlockVoxels>
      distance{};  ///< mean, in truncation distances, [-1, 1], > 0 in front
  std::array<float, kBlockVoxels> weight{};  ///< 0 = nobody said anything
};

inline constexpr std::size_t kNoBlock = std::numeric_limits<std::size_t>::max();

/// Where a block stands in a sorted list of keys, or kNoBlock.
[[nodiscard]] std::size_t find_block(std::span<const BlockKey> keys,
                                     const Eigen::Vector3i& position);

/// Where the 27 blocks around `center` stand in a sorted list, x fastest, itself in the middle; or
/// kNoBlock.
[[nodiscard]] std::array<std::size_t, 27> blocks_around(std::span<const BlockKey> keys,
                                                        BlockKey center);

/// A truncated signed distance function on those blocks of space that are near a surface: blocks in
/// the order of their keys, found by bisection. Voxel (x, y, z) of block (i, j, k) stands at
/// (8 i + x, 8 j + y, 8 k + z) times the voxel size.
class VoxelGrid {
 public:
  /// `keys` sorted, each once; `voxel_size` > 0.
  VoxelGrid(double voxel_size, std::vector<BlockKey> keys);

  [[nodiscard]] double voxel_size() const { return voxel_size_; }

  [[nodiscard]] std::size_t size() const { return keys_.size(); }

  [[nodiscard]] const std::vector<BlockKey>& keys() const { return keys_; }

  [[nodiscard]] BlockKey key(std::size_t block) const { return keys_[block]; }

  [[nodiscard]] VoxelBlock& block(std::size_t block) { return blocks_[block]; }

  [[nodiscard]] const VoxelBlock& block(std::size_t block) const { return blocks_[block]; }

  /// What a block takes here.
  static constexpr std::size_t kBytesPerBlock = sizeof(VoxelBlock) + sizeof(BlockKey);

 private:
  double voxel_size_;
  std::vector<BlockKey> keys_;
  std::vector<VoxelBlock> blocks_;
};

}  // namespace trigmesh
