#include "sfm/features/keypoint_spread.hpp"

#include <algorithm>
#include <array>
#include <random>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(SpreadKeypoints, KeepsAllWhenThereAreFew) {
  const std::vector<SpreadCandidate> candidates{{1, 1, 5}, {90, 90, 9}, {50, 50, 7}};
  const auto kept = spread_keypoints(candidates, 100, 100, 16);
  EXPECT_EQ(std::set<std::size_t>(kept.begin(), kept.end()), (std::set<std::size_t>{0, 1, 2}));
}

TEST(SpreadKeypoints, NothingGivesNothing) {
  EXPECT_THAT(spread_keypoints({}, 640, 480, 100), IsEmpty());
}

TEST(SpreadKeypoints, WeakPointsOfAnEmptyRegionGoBeforeTheCrowdOfAStrongOne) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(0.0F, 1.0F);
  std::vector<SpreadCandidate> candidates;
  for (int i = 0; i < 2000; ++i) {  // strong and crowded on the left
    candidates.push_back({100.0F * unit(random), 400.0F * unit(random), 10.0F + unit(random)});
  }
  for (int i = 0; i < 100; ++i) {  // weak and sparse elsewhere
    candidates.push_back({100.0F + 300.0F * unit(random), 400.0F * unit(random), unit(random)});
  }
  const auto kept = spread_keypoints(candidates, 400, 400, 400);
  ASSERT_EQ(kept.size(), 400U);
  const auto sparse =
      std::count_if(kept.begin(), kept.end(), [](std::size_t index) { return index >= 2000; });
  EXPECT_GE(sparse, 95);
}

TEST(SpreadKeypoints, PrefersTheStrongestWithinACell) {
  const std::vector<SpreadCandidate> candidates{{5, 5, 1}, {6, 6, 3}, {7, 7, 2}};
  EXPECT_THAT(spread_keypoints(candidates, 16, 16, 2), ElementsAre(1, 2));
}

TEST(SpreadKeypoints, EqualStrengthsAreTakenInOrder) {
  const std::vector<SpreadCandidate> candidates{{5, 5, 1}, {6, 6, 1}, {7, 7, 1}};
  EXPECT_THAT(spread_keypoints(candidates, 16, 16, 2), ElementsAre(0, 1));
}

TEST(SpreadKeypoints, PointsOnTheBorderBelongToTheBorderCells) {
  const std::vector<SpreadCandidate> candidates{{-0.4F, 99.4F, 1}, {99.4F, -0.4F, 1}};
  EXPECT_EQ(spread_keypoints(candidates, 100, 100, 5).size(), 2U);
}

}  // namespace
}  // namespace trigmesh
