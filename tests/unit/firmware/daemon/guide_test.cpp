#include "firmware/daemon/guide.hpp"

#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

FrameJudged frame(FrameVerdict verdict, double brightness = 120.0, double sharpness = 1.0) {
  FrameJudged judged;
  judged.verdict = verdict;
  judged.measures.brightness = brightness;
  judged.measures.relative_sharpness = sharpness;
  return judged;
}

std::vector<FrameJudged> frames(std::size_t count, const FrameJudged& one) {
  return std::vector<FrameJudged>(count, one);
}

MapFollowed followed(MapFollowing following, std::size_t photographs, std::size_t tracked) {
  MapFollowed map;
  map.frame.following = following;
  map.photographs = photographs;
  map.tracked = tracked;
  return map;
}

TEST(Guide, SaysNothingAtFirstAndWhileAllIsWell) {
  Guide guide;
  EXPECT_EQ(guide.advice(), Advice::kNone);
  guide.see(frames(30, frame(FrameVerdict::kTooLittleMotion)));
  guide.follow(followed(MapFollowing::kTracked, 20, 20));
  EXPECT_EQ(guide.advice(), Advice::kNone);
}

TEST(Guide, AFewBadFramesAreNoHabit) {
  Guide guide;
  guide.see(frames(3, frame(FrameVerdict::kTooFast)));
  EXPECT_EQ(guide.advice(), Advice::kNone);
  guide.see(frames(20, frame(FrameVerdict::kKept)));
  EXPECT_EQ(guide.advice(), Advice::kNone);
}

TEST(Guide, TellsToMoveSlowerUntilItIsHeeded) {
  Guide guide;
  guide.see(frames(20, frame(FrameVerdict::kKept)));
  guide.see(frames(10, frame(FrameVerdict::kTooFast)));
  EXPECT_EQ(guide.advice(), Advice::kSlower);
  guide.see(frames(15, frame(FrameVerdict::kTooLittleMotion)));
  EXPECT_EQ(guide.advice(), Advice::kSlower) << "10 of 30";
  guide.see(frames(15, frame(FrameVerdict::kTooLittleMotion)));
  EXPECT_EQ(guide.advice(), Advice::kNone);
}

TEST(Guide, DarknessIsToldBeforeSpeed) {
  Guide guide;
  guide.see(frames(20, frame(FrameVerdict::kTooFast, 20.0)));
  EXPECT_EQ(guide.advice(), Advice::kMoreLight);
}

TEST(Guide, BlurCountsOnlyWhereItHurts) {
  Guide guide;
  guide.see(frames(20, frame(FrameVerdict::kBlurred, 120.0, 0.9)));
  EXPECT_EQ(guide.advice(), Advice::kNone) << "a sharper neighbour was kept";
  guide.see(frames(20, frame(FrameVerdict::kBlurred, 120.0, 0.3)));
  EXPECT_EQ(guide.advice(), Advice::kHoldSteady);
}

TEST(Guide, LostTwiceInARowMeansGoBackUntilItIsFoundAgain) {
  Guide guide;
  guide.follow(followed(MapFollowing::kLost, 11, 10));
  EXPECT_EQ(guide.advice(), Advice::kNone);
  guide.follow(followed(MapFollowing::kLost, 12, 10));
  EXPECT_EQ(guide.advice(), Advice::kGoBack);
  guide.follow(followed(MapFollowing::kTracked, 13, 11));
  EXPECT_EQ(guide.advice(), Advice::kNone);
}

TEST(Guide, WithoutParallaxItAsksToStepSideways) {
  Guide guide;
  guide.follow(followed(MapFollowing::kWaiting, 9, 0));
  EXPECT_EQ(guide.advice(), Advice::kNone);
  guide.follow(followed(MapFollowing::kWaiting, 10, 0));
  EXPECT_EQ(guide.advice(), Advice::kStepSideways);
}

TEST(Guide, AWalkThatCameAroundIsEnough) {
  Guide guide;
  MapFollowed map = followed(MapFollowing::kTracked, 30, 30);
  guide.follow(map);
  EXPECT_EQ(guide.advice(), Advice::kNone);
  map.closes_loop = true;
  guide.follow(map);
  EXPECT_EQ(guide.advice(), Advice::kEnough);
  guide.follow(followed(MapFollowing::kTracked, 40, 34));
  EXPECT_EQ(guide.advice(), Advice::kNone) << "too many do not connect";
  guide.begin();
  guide.follow(followed(MapFollowing::kTracked, 30, 30));
  EXPECT_EQ(guide.advice(), Advice::kNone) << "another walk";
}

TEST(Guide, EveryAdviceHasAWordAndASentence) {
  for (const Advice advice : {Advice::kNone,
                              Advice::kGoBack,
                              Advice::kMoreLight,
                              Advice::kSlower,
                              Advice::kHoldSteady,
                              Advice::kStepSideways,
                              Advice::kEnough}) {
    EXPECT_FALSE(to_string(advice).empty());
    EXPECT_FALSE(sentence_of(advice).empty());
  }
}

}  // namespace
}  // namespace trigmesh
