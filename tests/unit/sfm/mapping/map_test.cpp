#include "sfm/mapping/map.hpp"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/sfm/mapping/mapping_test_scenes.hpp"

namespace trigmesh {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// Five views that see all of 40 points, poses and landmarks true.
class MapTest : public ::testing::Test {
 protected:
  MapTest()
      : scene_(test_support::make_synthetic_scene({.cloud = test_support::CloudKind::kVolume,
                                                   .points = 40,
                                                   .views = 5,
                                                   .dropout_ratio = 0.3})),
        tracks_(mapping_test::make_store(scene_).tracks),
        map_(mapping_test::make_map(tracks_, scene_.truth)) {
    mapping_test::register_truth(map_, scene_.truth, 0, 5);
    for (const Landmark& landmark : scene_.truth.landmarks) {
      map_.add_landmark(
          mapping_test::track_of(tracks_, landmark), landmark.position_in_world, landmark.track);
    }
  }

  /// Both sides of all observations agree, every landmark has two views with a pose, counts are
  /// right.
  void expect_consistent() const {
    const Scene compact = map_.compact();
    EXPECT_TRUE(compact.validate().has_value());
    EXPECT_EQ(compact.landmarks.size(), map_.landmark_count());
    EXPECT_EQ(map_.landmarks().size(), map_.landmark_count());
    for (const Landmark& landmark : compact.landmarks) {
      EXPECT_GE(landmark.track.size(), 2U);
      for (const Observation& observation : landmark.track) {
        EXPECT_TRUE(map_.is_registered(observation.view));
      }
    }
    for (std::size_t i = 0; i < compact.views.size(); ++i) {
      const auto view = id_of<ViewId>(i);
      EXPECT_EQ(map_.visible_count(view), map_.candidates(view).size());
      for (std::size_t k = 0; k < compact.views[i].landmarks.size(); ++k) {
        const LandmarkId seen = map_.scene().views[i].landmarks[k];
        EXPECT_TRUE(seen == kNoLandmark || map_.exists(seen));
      }
    }
  }

  /// A landmark with so many observations.
  [[nodiscard]] LandmarkId landmark_seen_by(std::size_t views) const {
    for (const LandmarkId id : map_.landmarks()) {
      if (map_.landmark(id).track.size() == views) {
        return id;
      }
    }
    ADD_FAILURE() << "no landmark is seen by " << views << " views";
    return {};
  }

  test_support::SyntheticScene scene_;
  TrackTable tracks_;
  Map map_;
};

TEST_F(MapTest, HoldsWhatWasAdded) {
  EXPECT_EQ(map_.landmark_count(), scene_.truth.landmarks.size());
  EXPECT_THAT(map_.registered(),
              ElementsAre(ViewId{0}, ViewId{1}, ViewId{2}, ViewId{3}, ViewId{4}));
  for (const LandmarkId id : map_.landmarks()) {
    EXPECT_EQ(map_.landmark_of(map_.track_of(id)), id);
  }
  expect_consistent();
}

TEST_F(MapTest, VisibleCountIsTheNumberOfMatchedKeypoints) {
  for (std::size_t i = 0; i < scene_.truth.views.size(); ++i) {
    const auto& landmarks = scene_.truth.views[i].landmarks;
    const auto matched = std::count_if(
        landmarks.begin(), landmarks.end(), [](LandmarkId id) { return id != kNoLandmark; });
    EXPECT_EQ(map_.visible_count(id_of<ViewId>(i)), static_cast<std::size_t>(matched));
  }
}

TEST_F(MapTest, RemovingAnObservationLeavesTheOthers) {
  const LandmarkId id = landmark_seen_by(4);
  const Observation gone = map_.landmark(id).track[1];
  map_.remove_observation(id, gone);
  EXPECT_EQ(map_.landmark(id).track.size(), 3U);
  EXPECT_EQ(map_.scene().views[index(gone.view)].landmarks[index(gone.feature)], kNoLandmark);
  expect_consistent();
  map_.add_observation(id, gone);
  EXPECT_EQ(map_.landmark(id).track[1], gone);
  expect_consistent();
}

TEST_F(MapTest, ALandmarkGoesWithItsSecondLastObservation) {
  const LandmarkId id = landmark_seen_by(2);
  const TrackId track = map_.track_of(id);
  map_.remove_observation(id, map_.landmark(id).track[0]);
  EXPECT_FALSE(map_.exists(id));
  EXPECT_EQ(map_.landmark_of(track), kNoLandmark);
  expect_consistent();
}

TEST_F(MapTest, ARemovedLandmarkMayComeBack) {
  const LandmarkId id = landmark_seen_by(3);
  const TrackId track = map_.track_of(id);
  const std::vector<Observation> observations = map_.landmark(id).track;
  map_.remove_landmark(id);
  expect_consistent();
  map_.add_landmark(track, Eigen::Vector3d::UnitZ(), observations);
  EXPECT_TRUE(map_.exists(map_.landmark_of(track)));
  expect_consistent();
}

TEST_F(MapTest, UnregisteringAViewTakesItsObservationsAlong) {
  map_.unregister_view(ViewId{2});
  EXPECT_FALSE(map_.is_registered(ViewId{2}));
  EXPECT_THAT(map_.registered(), ElementsAre(ViewId{0}, ViewId{1}, ViewId{3}, ViewId{4}));
  EXPECT_THAT(map_.scene().views[2].landmarks, ::testing::Each(kNoLandmark));
  EXPECT_GT(map_.visible_count(ViewId{2}), 0U);
  expect_consistent();
}

TEST_F(MapTest, NothingIsLeftWhenAllViewsButOneHaveGone) {
  for (unsigned i = 0; i < 4; ++i) {
    map_.unregister_view(ViewId{i});
  }
  EXPECT_EQ(map_.landmark_count(), 0U);
  EXPECT_THAT(map_.compact().landmarks, IsEmpty());
  expect_consistent();
}

TEST_F(MapTest, CandidatesComeByFeatureAndNameTheirLandmarks) {
  const auto candidates = map_.candidates(ViewId{1});
  ASSERT_FALSE(candidates.empty());
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Map::Candidate& candidate = candidates[i];
    EXPECT_TRUE(i == 0 || candidates[i - 1].feature < candidate.feature);
    EXPECT_EQ(map_.track_of(candidate.landmark), tracks_.track_of({ViewId{1}, candidate.feature}));
  }
}

TEST(Map, LandmarksOfAbsorbedTracksGoAndTheirKeypointsAreFreeAgain) {
  TrackTable tracks;
  Scene scene;
  scene.cameras.push_back(test_support::SyntheticSceneOptions{}.camera);
  for (int i = 0; i < 4; ++i) {
    tracks.add_view(1);
    scene.views.push_back({"view", CameraId{0}, std::nullopt, {{10.0F, 10.0F}}, {}});
  }
  const auto match = std::vector<FeatureMatch>{{FeatureIndex{0}, FeatureIndex{0}}};
  (void)tracks.add_matches({ViewId{0}, ViewId{1}}, match);
  (void)tracks.add_matches({ViewId{2}, ViewId{3}}, match);
  Map map = mapping_test::make_map(tracks, scene);
  for (unsigned i = 0; i < 4; ++i) {
    map.register_view(ViewId{i}, Rigid3{});
  }
  for (const unsigned view : {0U, 2U}) {
    const TrackId track = tracks.track_of({ViewId{view}, FeatureIndex{0}});
    map.add_landmark(track, Eigen::Vector3d::UnitZ(), tracks.observations(track));
  }
  const std::vector<TrackId> absorbed = tracks.add_matches({ViewId{1}, ViewId{2}}, match);
  map.tracks_changed(absorbed);
  EXPECT_EQ(map.landmark_count(), 1U);
  EXPECT_TRUE(map.compact().validate().has_value());
  const LandmarkId left = map.landmarks().front();
  EXPECT_EQ(map.landmark(left).track.size(), 2U);
  for (unsigned i = 0; i < 4; ++i) {
    EXPECT_EQ(map.visible_count(ViewId{i}), 1U) << i;
  }
}

}  // namespace
}  // namespace trigmesh
