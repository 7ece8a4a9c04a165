#include "drivers/indicator/pattern.hpp"

#include <set>
#include <string>

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;

std::string picture(IndicatorPattern pattern, nanoseconds span, nanoseconds step) {
  std::string text;
  for (nanoseconds time{0}; time < span; time += step) {
    const IndicatorLevels levels = levels_at(pattern, time);
    text += levels.buzzer ? 'B' : levels.light ? '#' : '.';
  }
  return text;
}

TEST(Pattern, LooksAsTheReadmeSays) {
  EXPECT_EQ(picture(IndicatorPattern::kOff, 2s, 500ms), "....");
  EXPECT_EQ(picture(IndicatorPattern::kCapturing, 2s, 500ms), "####");
  EXPECT_EQ(picture(IndicatorPattern::kWorking, 3200ms, 400ms), "##..##..");
  EXPECT_EQ(picture(IndicatorPattern::kLost, 2s, 250ms), "BB..BB..");
  EXPECT_EQ(picture(IndicatorPattern::kSlower, 400ms, 40ms), "BB...BB...");
  EXPECT_EQ(picture(IndicatorPattern::kDone, 4s, 500ms), "B#####..");
  EXPECT_EQ(picture(IndicatorPattern::kFailed, 4500ms, 150ms), "BBBBBBB...#.#.......#.#.......");
  EXPECT_EQ(picture(IndicatorPattern::kStorageLow, 1s, 50ms), "BB...##...##........");
}

TEST(Pattern, RepeatsExactly) {
  for (nanoseconds time{0}; time < 3s; time += 30ms) {
    EXPECT_EQ(levels_at(IndicatorPattern::kIdle, time),
              levels_at(IndicatorPattern::kIdle, time + 1'000'000 * 3s));
  }
}

TEST(Pattern, TheNextChangeIsWhereTheLevelsChange) {
  EXPECT_EQ(next_change(IndicatorPattern::kIdle, 0s), 60ms);
  EXPECT_EQ(next_change(IndicatorPattern::kIdle, 60ms), 3s);
  EXPECT_EQ(next_change(IndicatorPattern::kIdle, 6s), 6060ms);
  EXPECT_EQ(next_change(IndicatorPattern::kFailed, 1200ms), 1500ms);
  EXPECT_EQ(next_change(IndicatorPattern::kFailed, 1500ms), 1650ms);
  EXPECT_FALSE(next_change(IndicatorPattern::kCapturing, 5s));
  EXPECT_FALSE(next_change(IndicatorPattern::kDone, 10s));
  EXPECT_EQ(next_change(IndicatorPattern::kWorking, -1s), 800ms);
}

TEST(Pattern, FollowingTheChangesSeesEveryStep) {
  for (std::size_t i = 0; i < kPatternCount; ++i) {
    const auto pattern = static_cast<IndicatorPattern>(i);
    nanoseconds time{0};
    for (int step = 0; step < 50; ++step) {
      const auto next = next_change(pattern, time);
      if (!next) {
        break;
      }
      ASSERT_GT(*next, time) << to_string(pattern);
      EXPECT_EQ(levels_at(pattern, *next - 1ns), levels_at(pattern, time)) << to_string(pattern);
      time = *next;
    }
  }
}

TEST(Pattern, EachHasStepsANameAndALookOfItsOwn) {
  std::set<std::string_view> names;
  std::set<std::string> pictures;
  for (std::size_t i = 0; i < kPatternCount; ++i) {
    const auto pattern = static_cast<IndicatorPattern>(i);
    names.insert(to_string(pattern));
    pictures.insert(picture(pattern, 12s, 20ms));
    const PatternSteps steps = steps_of(pattern);
    EXPECT_FALSE(steps.once.empty() && steps.repeated.empty()) << to_string(pattern);
    for (const auto part : {steps.once, steps.repeated}) {
      for (const PatternStep& step : part) {
        EXPECT_GT(step.duration.count(), 0) << to_string(pattern);
      }
    }
  }
  EXPECT_EQ(names.size(), kPatternCount);
  EXPECT_EQ(pictures.size(), kPatternCount);
}

}  // namespace
}  // namespace trigmesh
