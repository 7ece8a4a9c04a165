#include "sfm/surface/voxel_tiles.hpp"

#include <algorithm>
#include <random>

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

/// A shell of blocks, as a surface leaves it.
std::vector<BlockKey> shell() {
  std::vector<BlockKey> keys;
  for (int z = -9; z <= 9; ++z) {
    for (int y = -9; y <= 9; ++y) {
      for (int x = -9; x <= 9; ++x) {
        const double radius = Eigen::Vector3d(x, y, z).norm();
        if (radius > 7.0 && radius < 9.0) {
          keys.push_back(*block_key({x, y, z}));
        }
      }
    }
  }
  return keys;
}

TEST(VoxelTiles, HoldEachBlockOnceWithAllBlocksAroundIt) {
  const std::vector<BlockKey> keys = shell();
  const std::vector<VoxelTile> tiles = make_tiles(keys, 300);
  EXPECT_GE(tiles.size(), 8U);
  std::vector<int> owners(keys.size(), 0);
  for (const VoxelTile& tile : tiles) {
    EXPECT_LE(tile.keys.size(), 300U);
    EXPECT_TRUE(std::is_sorted(tile.keys.begin(), tile.keys.end()));
    EXPECT_TRUE(std::is_sorted(tile.blocks.begin(), tile.blocks.end()));
    for (const std::uint32_t block : tile.blocks) {
      ++owners[block];
      for (const std::size_t near : blocks_around(keys, keys[block])) {
        EXPECT_TRUE(near == kNoBlock ||
                    std::binary_search(tile.keys.begin(), tile.keys.end(), keys[near]));
      }
    }
  }
  EXPECT_TRUE(std::all_of(owners.begin(), owners.end(), [](int n) { return n == 1; }));
}

TEST(VoxelTiles, AreOneWhenAllFits) {
  const std::vector<BlockKey> keys = shell();
  const std::vector<VoxelTile> tiles = make_tiles(keys, keys.size());
  ASSERT_EQ(tiles.size(), 1U);
  EXPECT_EQ(tiles[0].keys, keys);
  EXPECT_TRUE(make_tiles({}, 27).empty());
}

TEST(VoxelTiles, AreInReachOfEveryViewThatHasAVoxelInItsPicture) {
  constexpr double kVoxel = 0.125;
  const std::vector<VoxelTile> tiles = make_tiles(shell(), 300);
  ViewReach view;
  view.camera = {.model = CameraModel::kPinhole,
                 .width_px = 60,
                 .height_px = 40,
                 .fx_px = 70.0,
                 .fy_px = 70.0,
                 .cx_px = 29.5,
                 .cy_px = 19.5};
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  int skipped = 0;
  for (int trial = 0; trial < 6; ++trial) {
    view.cam_from_world.rotation =
        Eigen::Quaterniond(uniform(random), uniform(random), uniform(random), uniform(random))
            .normalized();
    view.cam_from_world.translation =
        9.0 * Eigen::Vector3d(uniform(random), uniform(random), uniform(random));
    view.max_depth = 8.0;
    for (const VoxelTile& tile : tiles) {
      if (may_reach(view, tile, kVoxel)) {
        continue;
      }
      ++skipped;
      bool seen = false;
      for (const BlockKey key : tile.keys) {
        for (int v = 0; v < 512; ++v) {
          const Eigen::Vector3i at =
              8 * block_position(key) + Eigen::Vector3i(v % 8, v / 8 % 8, v / 64);
          const Eigen::Vector3d p = view.cam_from_world * (kVoxel * at.cast<double>());
          const double x = 70.0 * p.x() / p.z() + 29.5;
          const double y = 70.0 * p.y() / p.z() + 19.5;
          seen =
              seen || (p.z() > 0.0 && p.z() < 8.0 && x > -0.5 && x < 59.5 && y > -0.5 && y < 39.5);
        }
      }
      EXPECT_FALSE(seen);
    }
  }
  EXPECT_GT(skipped, 10);
  view.max_depth = 0.0;
  EXPECT_FALSE(may_reach(view, tiles[0], kVoxel));
}

}  // namespace
}  // namespace trigmesh
