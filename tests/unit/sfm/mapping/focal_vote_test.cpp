#include "sfm/mapping/focal_vote.hpp"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/random.hpp"
#include "tests/unit/sfm/mapping/mapping_test_scenes.hpp"

namespace trigmesh {
namespace {

using test_support::SyntheticScene;

/// A camera path without the symmetries under which pairs do not bind the focal length.
SyntheticScene general_scene(std::size_t groups, double focal_px = 700.0) {
  test_support::SyntheticSceneOptions options;
  options.cloud = test_support::CloudKind::kVolume;
  options.points = 60;
  options.path = test_support::PathKind::kRandom;
  options.camera_groups = groups;
  options.camera.fx_px = options.camera.fy_px = focal_px;
  return test_support::make_synthetic_scene(options);
}

std::vector<FocalEvidence> evidence_of(const SyntheticScene& scene) {
  std::vector<FocalEvidence> evidence;
  for (const auto& [pair, geometry] : scene.pairs) {
    evidence.push_back({scene.truth.views[index(pair.first)].camera,
                        scene.truth.views[index(pair.second)].camera,
                        geometry.fundamental,
                        static_cast<double>(geometry.inliers.size())});
  }
  return evidence;
}

class FocalVote : public ::testing::TestWithParam<double> {};

TEST_P(FocalVote, FindsOneFocalLength) {
  const double focal_px = GetParam();
  const SyntheticScene scene = general_scene(1, focal_px);
  const auto found = vote_focal_lengths(scene.truth.cameras, {true}, evidence_of(scene));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(found[0], focal_px, 0.01 * focal_px);
}

INSTANTIATE_TEST_SUITE_P(WideToLong, FocalVote, ::testing::Values(500.0, 700.0, 1100.0, 1700.0));

TEST(FocalVote, FindsTheFocalLengthsOfTwoGroups) {
  const SyntheticScene scene = general_scene(2);
  const auto found = vote_focal_lengths(scene.truth.cameras, {true, true}, evidence_of(scene));
  ASSERT_EQ(found.size(), 2U);
  EXPECT_NEAR(found[0], 700.0, 7.0);
  EXPECT_NEAR(found[1], 770.0, 7.7);
}

TEST(FocalVote, KnownGroupsKeepTheirsAndHelpTheOthers) {
  const SyntheticScene scene = general_scene(2);
  const auto found = vote_focal_lengths(scene.truth.cameras, {false, true}, evidence_of(scene));
  EXPECT_EQ(found[0], scene.truth.cameras[0].fx_px);
  EXPECT_NEAR(found[1], 770.0, 7.7);
}

TEST(FocalVote, WrongPairsDoNotPull) {
  const SyntheticScene scene = general_scene(1);
  std::vector<FocalEvidence> evidence = evidence_of(scene);
  test_support::Random random(3);
  for (std::size_t i = 0; i < evidence.size(); i += 4) {
    for (Eigen::Index k = 0; k < 9; ++k) {
      evidence[i].fundamental(k) *= 1.0 + random.normal();
    }
  }
  const auto found = vote_focal_lengths(scene.truth.cameras, {true}, evidence);
  EXPECT_NEAR(found[0], 700.0, 14.0);
}

TEST(FocalVote, KeepsAGuessWithoutEvidence) {
  const SyntheticScene scene = general_scene(1);
  EXPECT_DOUBLE_EQ(vote_focal_lengths(scene.truth.cameras, {true}, {})[0], 1.2 * 800.0);
}

TEST(FocalVote, NoCamerasGiveNoFocalLengths) {
  EXPECT_TRUE(vote_focal_lengths({}, {}, {}).empty());
}

}  // namespace
}  // namespace trigmesh
