#include "sfm/scale/known_lengths.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using ::testing::HasSubstr;

constexpr int kMarkers = 50;

TEST(KnownLengths, NoneByDefault) {
  EXPECT_FALSE(KnownLengths{}.any());
  EXPECT_TRUE(KnownLengths{}.validate(kMarkers));
  EXPECT_FALSE(KnownLengths{}.names(0));
}

TEST(KnownLengths, ASideOfItsOwnComesFirst) {
  const KnownLengths known{.marker_side_m = 0.1, .side_of_marker_m = {{3, 0.12}}};
  EXPECT_TRUE(known.any());
  EXPECT_EQ(known.side_m(0), 0.1);
  EXPECT_EQ(known.side_m(3), 0.12);
  const KnownLengths only_one{.side_of_marker_m = {{3, 0.12}}};
  EXPECT_EQ(only_one.side_m(0), std::nullopt);
  EXPECT_TRUE(only_one.names(3));
  EXPECT_FALSE(only_one.names(0));
}

TEST(KnownLengths, ADistanceNamesItsMarkers) {
  const KnownLengths known{.distance_m = {{{2, 5}, 0.5}}};
  EXPECT_TRUE(known.any());
  EXPECT_TRUE(known.names(2));
  EXPECT_TRUE(known.names(5));
  EXPECT_FALSE(known.names(3));
  EXPECT_EQ(known.side_m(2), std::nullopt);
}

TEST(KnownLengths, ComplainsAboutWhatCannotBe) {
  const auto complaint = [](const KnownLengths& known) {
    const auto valid = known.validate(kMarkers);
    return valid ? std::string("valid") : valid.error().message;
  };
  EXPECT_EQ(complaint({.marker_side_m = 2.0}), "valid");
  EXPECT_THAT(complaint({.marker_side_m = 2.1}), HasSubstr("the side of the markers is 2.1 m"));
  EXPECT_THAT(complaint({.marker_side_m = 0.0}), HasSubstr("must be in (0, 2] m"));
  EXPECT_THAT(complaint({.side_of_marker_m = {{3, -1.0}}}), HasSubstr("the side of marker 3"));
  EXPECT_THAT(complaint({.side_of_marker_m = {{50, 0.1}}}), HasSubstr("its markers are 0 to 49"));
  EXPECT_EQ(complaint({.distance_m = {{{0, 1}, 100.0}}}), "valid");
  EXPECT_THAT(complaint({.distance_m = {{{0, 1}, 101.0}}}), HasSubstr("between markers 0 and 1"));
  EXPECT_THAT(complaint({.distance_m = {{{1, 1}, 1.0}}}), HasSubstr("1-1 must be between two"));
  EXPECT_THAT(complaint({.distance_m = {{{-1, 1}, 1.0}}}), HasSubstr("marker -1"));
}

TEST(KnownLengths, NamesWhereUpComesFrom) {
  for (const UpSource source : {UpSource::kNone, UpSource::kCard}) {
    EXPECT_EQ(up_source_from_string(to_string(source)), source);
  }
  EXPECT_EQ(up_source_from_string("down"), std::nullopt);
}

}  // namespace
}  // namespace trigmesh
