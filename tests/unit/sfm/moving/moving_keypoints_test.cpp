#include "sfm/moving/moving_keypoints.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

/// A lattice of evidence: what has x below 100 moved.
std::vector<FeatureEvidence> lattice() {
  std::vector<FeatureEvidence> evidence;
  for (int y = 0; y < 200; y += 10) {
    for (int x = 0; x < 200; x += 10) {
      FeatureEvidence one;
      one.keypoint.x_px = static_cast<float>(x);
      one.keypoint.y_px = static_cast<float>(y);
      (x < 100 ? one.contradicting : one.agreeing) = 3;
      evidence.push_back(one);
    }
  }
  return evidence;
}

Keypoint at(float x, float y) {
  Keypoint keypoint;
  keypoint.x_px = x;
  keypoint.y_px = y;
  return keypoint;
}

TEST(MovingKeypoints, AreThoseAmongKeypointsThatMoved) {
  const std::vector<Keypoint> keypoints{at(42.0F, 71.0F), at(153.0F, 71.0F)};
  EXPECT_EQ(moving_keypoints(keypoints, lattice(), {}), (std::vector<std::uint8_t>{1, 0}));
}

TEST(MovingKeypoints, OneThatAgreesByChanceIsJudgedByItsSurroundings) {
  std::vector<FeatureEvidence> evidence = lattice();
  evidence[2 * 20 + 3].contradicting = 0;
  evidence[2 * 20 + 3].agreeing = 1;
  const std::vector<Keypoint> keypoints{evidence[2 * 20 + 3].keypoint};
  EXPECT_EQ(moving_keypoints(keypoints, evidence, {})[0], 1);
}

TEST(MovingKeypoints, FarFromAllEvidenceNothingMoves) {
  const std::vector<Keypoint> keypoints{at(-200.0F, 50.0F)};
  EXPECT_EQ(moving_keypoints(keypoints, lattice(), {})[0], 0);
}

TEST(MovingKeypoints, FewThatMovedAreAnAccident) {
  std::vector<FeatureEvidence> evidence = lattice();
  evidence.resize(5);
  const std::vector<Keypoint> keypoints{at(20.0F, 0.0F)};
  SurroundingsOptions options;
  EXPECT_EQ(moving_keypoints(keypoints, evidence, options)[0], 0);
  options.min_moved = 5;
  EXPECT_EQ(moving_keypoints(keypoints, evidence, options)[0], 1);
}

TEST(MovingKeypoints, SilentKeypointsAreNotAsked) {
  std::vector<FeatureEvidence> evidence = lattice();
  for (FeatureEvidence& one : evidence) {
    one.contradicting = 0;
  }
  const std::vector<Keypoint> keypoints{at(20.0F, 20.0F)};
  EXPECT_EQ(moving_keypoints(keypoints, evidence, {})[0], 0);
}

TEST(SurroundingsOptions, NameTheFieldThatIsWrong) {
  SurroundingsOptions options;
  EXPECT_TRUE(options.validate().has_value());
  options.neighbors = 0;
  EXPECT_THAT(options.validate().error().message, testing::HasSubstr("neighbors"));
  options = {};
  options.max_distance_px = 0.0;
  EXPECT_THAT(options.validate().error().message, testing::HasSubstr("max_distance_px"));
  options = {};
  options.min_moved_ratio = 0.5;
  EXPECT_THAT(options.validate().error().message, testing::HasSubstr("min_moved_ratio"));
}

}  // namespace
}  // namespace trigmesh
