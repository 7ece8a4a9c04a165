#include "firmware/pipeline/finish.hpp"

#include <numbers>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

std::vector<DenseView> one_view() {
  std::vector<DenseView> views(1);
  views[0].name = "a.jpg";
  return views;
}

/// A gap of this part of the surface, so many degrees from a.jpg.
ReachableGap gap_of(double area_ratio, double turn_left_deg = 0.0, double rise_deg = 0.0) {
  ReachableGap gap;
  gap.kind = GapKind::kHole;
  gap.area_ratio = area_ratio;
  gap.direction.turn_left_rad = turn_left_deg * kRadPerDeg;
  gap.direction.rise_rad = rise_deg * kRadPerDeg;
  gap.direction.elevation_rad = (30.0 + rise_deg) * kRadPerDeg;
  return gap;
}

FinishSection finish_of(const std::vector<ReachableGap>& gaps,
                        Verdict registration = Verdict::kComplete) {
  SurfaceCoverage coverage{gaps, 0.0};
  for (const ReachableGap& gap : gaps) {
    coverage.gap_ratio += gap.area_ratio;
  }
  return judge_finish(coverage, one_view(), registration);
}

std::string advice_for(double turn_left_deg, double rise_deg) {
  return finish_of({gap_of(0.1, turn_left_deg, rise_deg)}).gaps.at(0).advice;
}

TEST(Finish, IsReadyWithoutGaps) {
  const FinishSection finish = finish_of({});
  EXPECT_TRUE(finish.ready);
  EXPECT_THAT(finish.sentence, StartsWith("Ready"));
  EXPECT_TRUE(finish.gaps.empty());
}

TEST(Finish, IsNotReadyWithOneLargeGapOrManySmallOnes) {
  EXPECT_TRUE(finish_of({gap_of(0.019)}).ready);
  EXPECT_FALSE(finish_of({gap_of(0.021)}).ready);
  EXPECT_TRUE(finish_of({gap_of(0.013), gap_of(0.013), gap_of(0.013)}).ready);
  const FinishSection finish = finish_of({gap_of(0.014), gap_of(0.014), gap_of(0.014)});
  EXPECT_FALSE(finish.ready);
  EXPECT_EQ(finish.sentence,
            "Not ready: 4.2 % of the surface is open or seen too little, the largest place of it "
            "1.4 %.");
}

TEST(Finish, IsNotReadyWhenMostPhotographsAreMissing) {
  const FinishSection finish = finish_of({}, Verdict::kNotReady);
  EXPECT_FALSE(finish.ready);
  EXPECT_THAT(finish.sentence, HasSubstr("most photographs are not part of the model"));
  EXPECT_TRUE(finish_of({}, Verdict::kPartial).ready);
}

TEST(Finish, TellsAtMostFiveGapsThatAreWorthIt) {
  EXPECT_EQ(finish_of(std::vector<ReachableGap>(9, gap_of(0.01))).gaps.size(), 5U);
  EXPECT_EQ(finish_of({gap_of(0.01), gap_of(0.002)}).gaps.size(), 1U);
}

TEST(Finish, SaysWhereToStand) {
  EXPECT_EQ(advice_for(42, 0),
            "a hole, 10.0 % of the surface: from where a.jpg was taken go about 40\u00b0 to the "
            "left around it");
  EXPECT_THAT(advice_for(-88, 22),
              HasSubstr("go about 90\u00b0 to the right around it and hold the camera higher, by "
                        "about 20\u00b0"));
  EXPECT_THAT(advice_for(4, -22),
              HasSubstr("from where a.jpg was taken hold the camera lower, by about 20\u00b0"));
  EXPECT_THAT(advice_for(4, 4), HasSubstr("from about where a.jpg was taken"));
  EXPECT_THAT(advice_for(80, 45), HasSubstr("from steeply above, about 45\u00b0 higher than in a"));
}

TEST(Finish, KeepsTheNumbersBehindTheWords) {
  const FinishGap gap = finish_of({gap_of(0.1, -42.0, 13.0)}).gaps.at(0);
  EXPECT_EQ(gap.photograph, "a.jpg");
  EXPECT_NEAR(gap.turn_left_deg, -42.0, 1e-9);
  EXPECT_NEAR(gap.rise_deg, 13.0, 1e-9);
  EXPECT_EQ(gap.area_ratio, 0.1);
}

}  // namespace
}  // namespace trigmesh
