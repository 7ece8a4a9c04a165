#include "sfm/mapping/map_joining.hpp"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sfm/mapping/structure.hpp"
#include "tests/support/matchers.hpp"
#include "tests/support/random.hpp"
#include "tests/unit/sfm/mapping/mapping_test_scenes.hpp"

namespace trigmesh {
namespace {

using test_support::ReconstructionNear;

const Sim3 kOtherWorld{
    2.5,
    Eigen::Quaterniond(Eigen::AngleAxisd(1.1, Eigen::Vector3d(0.3, -0.5, 0.8).normalized())),
    Eigen::Vector3d(3.0, -7.0, 1.0)};

/// Two maps of one scene: views 0 to 3 in the true world, views 4 to 7 in another one.
class MapJoining : public ::testing::Test {
 protected:
  MapJoining()
      : scene_(test_support::make_synthetic_scene(
            {.cloud = test_support::CloudKind::kVolume, .points = 150, .views = 8})),
        tracks_(mapping_test::make_store(scene_).tracks),
        a_(mapping_test::make_map(tracks_, scene_.truth)),
        b_(mapping_test::make_map(tracks_, scene_.truth)) {
    mapping_test::register_truth(a_, scene_.truth, 0, 4);
    for (std::size_t i = 4; i < 8; ++i) {
      b_.register_view(id_of<ViewId>(i),
                       transform_pose(kOtherWorld, *scene_.truth.views[i].cam_from_world));
    }
    const Structure structure(tracks_, options_, executor_);
    (void)structure.triangulate_all(a_);  // how many is not what these tests are about
    (void)structure.triangulate_all(b_);
  }

  [[nodiscard]] std::optional<Sim3> overlap(std::size_t min_common = 15) const {
    return find_overlap(a_, b_, min_common, 0.03, 0);
  }

  test_support::SyntheticScene scene_;
  TrackTable tracks_;
  Map a_;
  Map b_;
  MapperOptions options_;
  SerialExecutor executor_;
};

TEST_F(MapJoining, FindsTheSimilarityBetweenTwoWorlds) {
  const auto a_from_b = overlap();
  ASSERT_TRUE(a_from_b.has_value());
  const Sim3 expected = kOtherWorld.inverse();
  EXPECT_NEAR(a_from_b->scale, expected.scale, 1e-4);
  EXPECT_LT(a_from_b->rotation.angularDistance(expected.rotation), 1e-4);
  EXPECT_LT((a_from_b->translation - expected.translation).norm(), 1e-3);
}

TEST_F(MapJoining, BearsAFewWrongLandmarks) {
  const std::vector<LandmarkId> ids = b_.landmarks();
  test_support::Random random(5);
  for (std::size_t i = 0; i < ids.size(); i += 4) {
    b_.set_position(ids[i], 10.0 * random.normal3());
  }
  const auto a_from_b = overlap();
  ASSERT_TRUE(a_from_b.has_value());
  EXPECT_NEAR(a_from_b->scale, kOtherWorld.inverse().scale, 1e-3);
}

TEST_F(MapJoining, RefusesWhenTheCommonLandmarksDoNotAgree) {
  test_support::Random random(5);
  for (const LandmarkId id : b_.landmarks()) {
    b_.set_position(id, random.normal3());
  }
  EXPECT_FALSE(overlap().has_value());
}

TEST_F(MapJoining, RefusesWhenTooFewLandmarksAreCommon) {
  EXPECT_FALSE(overlap(10000).has_value());
  EXPECT_FALSE(find_overlap(a_, mapping_test::make_map(tracks_, scene_.truth), 15, 0.03, 0));
}

TEST_F(MapJoining, AbsorbsViewsAndLandmarksConsistently) {
  const LandmarkId only_in_b = b_.landmarks().front();
  const TrackId track = b_.track_of(only_in_b);
  ASSERT_NE(a_.landmark_of(track), kNoLandmark);
  a_.remove_landmark(a_.landmark_of(track));
  absorb(a_, b_, *overlap());
  const Scene joined = a_.compact();
  EXPECT_TRUE(joined.validate().has_value());
  EXPECT_EQ(joined.registered_count(), 8U);
  EXPECT_THAT(joined, ReconstructionNear(scene_.truth, 1e-3, 1e-3));
  EXPECT_NE(a_.landmark_of(track), kNoLandmark);
  EXPECT_EQ(a_.landmark_count(), scene_.truth.landmarks.size());
  for (const Landmark& landmark : joined.landmarks) {
    EXPECT_EQ(landmark.track.size(),
              tracks_.observations(tracks_.track_of(landmark.track[0])).size() -
                  (landmark.track.size() == 4 ? 4U : 0U));
  }
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(a_.visible_count(id_of<ViewId>(i)), a_.candidates(id_of<ViewId>(i)).size());
  }
}

}  // namespace
}  // namespace trigmesh
