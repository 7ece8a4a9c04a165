#include "sfm/mapping/refusal.hpp"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/sfm/mapping/mapping_test_scenes.hpp"

namespace trigmesh {
namespace {

using ::testing::HasSubstr;

/// Image 0, about which is asked, and three others that it has pairs with.
class Refusal : public ::testing::Test {
 protected:
  Refusal() {
    for (int i = 0; i < 4; ++i) {
      store_.images.push_back(
          {"image", CameraId{0}, std::vector<Eigen::Vector2f>(500), {}, {}, false});
    }
    store_.images[0].name = "asked.jpg";
  }

  void add_pair(TwoViewKind kind, std::size_t inliers = 40) {
    TwoViewGeometry geometry;
    geometry.kind = kind;
    geometry.inliers.resize(kind == TwoViewKind::kNone ? 0 : inliers);
    geometry.candidates = inliers + 5;
    store_.images[0].pairs.push_back(store_.pairs.size());
    store_.pairs.push_back({{ViewId{0}, id_of<ViewId>(store_.pairs.size() + 1)}, geometry});
  }

  void set_attempt(RefusalReason reason) { store_.images[0].attempt = {33, 7, reason}; }

  [[nodiscard]] ImageOutcome explain() const { return explain_refusal(store_, ViewId{0}, {}); }

  ImageStore store_;
};

TEST_F(Refusal, TooFewFeatures) {
  store_.images[0].keypoints_px.resize(12);
  const ImageOutcome outcome = explain();
  EXPECT_EQ(outcome.reason, RefusalReason::kTooFewFeatures);
  EXPECT_EQ(outcome.name, "asked.jpg");
  EXPECT_EQ(outcome.features, 12U);
  EXPECT_EQ(outcome.component, -1);
  EXPECT_THAT(outcome.detail, HasSubstr("12 features"));
}

TEST_F(Refusal, FewFeaturesAreNotTheReasonWhenTheyMatchWell) {
  store_.images[0].keypoints_px.resize(90);
  add_pair(TwoViewKind::kPureRotation, 80);
  EXPECT_EQ(explain().reason, RefusalReason::kPureRotation);
}

TEST_F(Refusal, NoOverlap) {
  add_pair(TwoViewKind::kNone, 6);
  add_pair(TwoViewKind::kWatermark, 60);
  const ImageOutcome outcome = explain();
  EXPECT_EQ(outcome.reason, RefusalReason::kNoOverlap);
  EXPECT_EQ(outcome.overlapping_images, 0U);
}

TEST_F(Refusal, OnlyDuplicates) {
  add_pair(TwoViewKind::kDuplicate);
  add_pair(TwoViewKind::kDuplicate);
  EXPECT_EQ(explain().reason, RefusalReason::kDuplicate);
}

TEST_F(Refusal, OnlyTurned) {
  add_pair(TwoViewKind::kPureRotation);
  add_pair(TwoViewKind::kDuplicate);
  const ImageOutcome outcome = explain();
  EXPECT_EQ(outcome.reason, RefusalReason::kPureRotation);
  EXPECT_EQ(outcome.overlapping_images, 2U);
}

TEST_F(Refusal, PoseRejectedWithTheNumbersThatDecided) {
  add_pair(TwoViewKind::kGeneral);
  set_attempt(RefusalReason::kPoseRejected);
  const ImageOutcome outcome = explain();
  EXPECT_EQ(outcome.reason, RefusalReason::kPoseRejected);
  EXPECT_THAT(outcome.detail, HasSubstr("7 of 33"));
  EXPECT_EQ(outcome.map_matches, 33U);
  EXPECT_EQ(outcome.map_inliers, 7U);
}

TEST_F(Refusal, ReasonsOfTheLastTryAreKept) {
  add_pair(TwoViewKind::kGeneral);
  for (const RefusalReason reason : {RefusalReason::kPoseUnstable,
                                     RefusalReason::kTooFewMapMatches,
                                     RefusalReason::kNoParallax}) {
    set_attempt(reason);
    EXPECT_EQ(explain().reason, reason);
    EXPECT_FALSE(explain().detail.empty());
  }
}

TEST_F(Refusal, NoPairCarriesAModel) {
  add_pair(TwoViewKind::kGeneral);
  EXPECT_EQ(explain().reason, RefusalReason::kNoParallax);
}

TEST(DescribeRegistration, CountsObservationsAndMeasuresTheirError) {
  const auto scene = test_support::make_synthetic_scene(
      {.cloud = test_support::CloudKind::kVolume, .points = 60, .views = 3});
  const TrackTable tracks = mapping_test::make_store(scene).tracks;
  Map map = mapping_test::make_map(tracks, scene.truth);
  mapping_test::register_truth(map, scene.truth, 0, 3);
  for (const Landmark& landmark : scene.truth.landmarks) {
    map.add_landmark(
        mapping_test::track_of(tracks, landmark), landmark.position_in_world, landmark.track);
  }
  for (Eigen::Vector2f& pixel : map.scene_for_adjustment().views[1].keypoints_px) {
    pixel += Eigen::Vector2f(3.0F, 4.0F);
  }
  ImageOutcome outcome;
  describe_registration(outcome, map, ViewId{1}, 0);
  EXPECT_EQ(outcome.reason, RefusalReason::kNone);
  EXPECT_EQ(outcome.component, 0);
  EXPECT_EQ(outcome.observations, 60U);
  EXPECT_NEAR(outcome.rmse_px, 5.0, 1e-3);
  describe_registration(outcome, map, ViewId{1}, 2);
  EXPECT_EQ(outcome.reason, RefusalReason::kOtherComponent);
  EXPECT_EQ(outcome.component, 2);
}

}  // namespace
}  // namespace trigmesh
