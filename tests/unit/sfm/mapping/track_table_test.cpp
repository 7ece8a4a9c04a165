#include "sfm/mapping/track_table.hpp"

#include <set>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/sfm/mapping/mapping_test_scenes.hpp"

namespace trigmesh {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

ImagePair pair_of(unsigned first, unsigned second) {
  return {ViewId{first}, ViewId{second}};
}

Observation seen(unsigned view, unsigned feature) {
  return {ViewId{view}, FeatureIndex{feature}};
}

std::vector<FeatureMatch> match(unsigned first, unsigned second) {
  return {{FeatureIndex{first}, FeatureIndex{second}}};
}

TrackTable table_of(std::size_t views, std::size_t features) {
  TrackTable table;
  for (std::size_t i = 0; i < views; ++i) {
    table.add_view(features);
  }
  return table;
}

TEST(TrackTable, KeypointsWithoutMatchHaveNoTrack) {
  TrackTable table = table_of(2, 2);
  (void)table.add_matches(pair_of(0, 1), match(0, 1));
  EXPECT_EQ(table.track_of(seen(0, 1)), kNoTrack);
  EXPECT_EQ(table.track_of(seen(1, 0)), kNoTrack);
  EXPECT_NE(table.track_of(seen(0, 0)), kNoTrack);
  EXPECT_THAT(table.tracks_of(ViewId{0}), SizeIs(2));
}

TEST(TrackTable, ChainsMatchesIntoOneTrackSortedByView) {
  TrackTable table = table_of(4, 3);
  (void)table.add_matches(pair_of(2, 3), match(1, 2));
  (void)table.add_matches(pair_of(0, 1), match(2, 0));
  (void)table.add_matches(pair_of(0, 3), match(2, 2));
  const TrackId track = table.track_of(seen(1, 0));
  EXPECT_THAT(table.observations(track),
              ElementsAre(seen(0, 2), seen(1, 0), seen(2, 1), seen(3, 2)));
  for (const Observation& observation : table.observations(track)) {
    EXPECT_EQ(table.track_of(observation), track);
  }
}

TEST(TrackTable, RefusesAMatchThatWouldPutTwoKeypointsOfOneImageIntoATrack) {
  TrackTable table = table_of(3, 2);
  (void)table.add_matches(pair_of(0, 1), match(0, 0));
  (void)table.add_matches(pair_of(0, 2), match(1, 0));
  EXPECT_THAT(table.add_matches(pair_of(1, 2), match(0, 0)), IsEmpty());
  EXPECT_EQ(table.conflict_count(), 1U);
  EXPECT_THAT(table.observations(table.track_of(seen(0, 0))), ElementsAre(seen(0, 0), seen(1, 0)));
  EXPECT_THAT(table.observations(table.track_of(seen(0, 1))), ElementsAre(seen(0, 1), seen(2, 0)));
}

TEST(TrackTable, MatchesAddedFirstWin) {
  TrackTable table = table_of(3, 2);
  (void)table.add_matches(pair_of(1, 2), match(0, 0));
  (void)table.add_matches(pair_of(0, 1), match(0, 0));
  (void)table.add_matches(pair_of(0, 2), match(1, 0));
  EXPECT_EQ(table.conflict_count(), 1U);
  EXPECT_THAT(table.observations(table.track_of(seen(2, 0))),
              ElementsAre(seen(0, 0), seen(1, 0), seen(2, 0)));
}

TEST(TrackTable, TellsWhichTracksWereAbsorbedAndLeavesThemEmpty) {
  TrackTable table = table_of(4, 1);
  (void)table.add_matches(pair_of(0, 1), match(0, 0));
  (void)table.add_matches(pair_of(2, 3), match(0, 0));
  const TrackId one = table.track_of(seen(0, 0));
  const TrackId other = table.track_of(seen(2, 0));
  const std::vector<TrackId> absorbed = table.add_matches(pair_of(1, 2), match(0, 0));
  ASSERT_THAT(absorbed, SizeIs(1));
  EXPECT_TRUE(absorbed[0] == one || absorbed[0] == other);
  EXPECT_THAT(table.observations(absorbed[0]), IsEmpty());
  EXPECT_THAT(table.observations(absorbed[0] == one ? other : one), SizeIs(4));
}

TEST(TrackTable, SayingAMatchTwiceChangesNothing) {
  TrackTable table = table_of(2, 1);
  (void)table.add_matches(pair_of(0, 1), match(0, 0));
  EXPECT_THAT(table.add_matches(pair_of(0, 1), match(0, 0)), IsEmpty());
  EXPECT_EQ(table.conflict_count(), 0U);
}

TEST(TrackTable, NoTrackHoldsAnImageTwiceHoweverWrongTheMatches) {
  const auto scene =
      test_support::make_synthetic_scene({.points = 200, .views = 8, .outlier_ratio = 0.4});
  const TrackTable table = mapping_test::make_store(scene).tracks;
  EXPECT_GT(table.conflict_count(), 0U);
  for (std::size_t i = 0; i < table.size(); ++i) {
    std::set<ViewId> views;
    for (const Observation& observation : table.observations(id_of<TrackId>(i))) {
      EXPECT_TRUE(views.insert(observation.view).second);
      EXPECT_EQ(table.track_of(observation), id_of<TrackId>(i));
    }
  }
}

TEST(TrackTable, RightMatchesGiveTheTrueTracks) {
  const auto scene = test_support::make_synthetic_scene({.points = 200, .views = 6});
  const TrackTable table = mapping_test::make_store(scene).tracks;
  for (const Landmark& landmark : scene.truth.landmarks) {
    EXPECT_THAT(table.observations(mapping_test::track_of(table, landmark)),
                ::testing::ElementsAreArray(landmark.track));
  }
}

}  // namespace
}  // namespace trigmesh
