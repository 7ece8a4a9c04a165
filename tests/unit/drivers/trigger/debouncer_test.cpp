#include "drivers/trigger/debouncer.hpp"

#include <array>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;
using ::testing::ElementsAre;

constexpr TriggerAction kDown = TriggerAction::kPressed;
constexpr TriggerAction kUp = TriggerAction::kReleased;

struct Raw {
  nanoseconds time;
  TriggerAction action;
};

/// What comes out when the edges are fed one by one and time goes on for ever afterwards.
std::vector<TriggerEdge> debounced(Debouncer& debouncer, const std::vector<Raw>& edges) {
  std::vector<TriggerEdge> out;
  for (const Raw& edge : edges) {
    if (const auto settled = debouncer.feed(edge.time, edge.action)) {
      out.push_back(*settled);
    }
  }
  if (const auto settled = debouncer.settle(nanoseconds::max())) {
    out.push_back(*settled);
  }
  return out;
}

TEST(Debouncer, MakesOneEdgeOfABouncingContactAtItsFirstTouch) {
  Debouncer debouncer(10ms, kUp);
  EXPECT_THAT(debounced(debouncer,
                        {{100ms, kDown},
                         {101ms, kUp},
                         {103ms, kDown},
                         {300ms, kUp},
                         {302ms, kDown},
                         {303ms, kUp}}),
              ElementsAre(TriggerEdge{100ms, 0, kDown}, TriggerEdge{300ms, 0, kUp}));
  EXPECT_EQ(debouncer.suppressed_count(), 4U);
}

TEST(Debouncer, TakesASparkForNoise) {
  Debouncer debouncer(10ms, kUp);
  EXPECT_THAT(debounced(debouncer, {{50ms, kDown}, {51ms, kUp}}), ElementsAre());
  EXPECT_EQ(debouncer.suppressed_count(), 2U);
}

TEST(Debouncer, WaitsForRestAndSaysUntilWhen) {
  Debouncer debouncer(10ms, kUp);
  EXPECT_FALSE(debouncer.deadline());
  EXPECT_FALSE(debouncer.feed(100ms, kDown));
  EXPECT_EQ(debouncer.deadline(), 110ms);
  EXPECT_FALSE(debouncer.settle(110ms - 1ns));
  EXPECT_EQ(debouncer.settle(110ms), (TriggerEdge{100ms, 0, kDown}));
  EXPECT_FALSE(debouncer.deadline());
  EXPECT_FALSE(debouncer.settle(200ms));
}

TEST(Debouncer, AnEdgeAfterTheRestGivesTheOneBefore) {
  Debouncer debouncer(10ms, kUp);
  EXPECT_FALSE(debouncer.feed(100ms, kDown));
  EXPECT_EQ(debouncer.feed(150ms, kUp), (TriggerEdge{100ms, 0, kDown}));
  EXPECT_EQ(debouncer.settle(1s), (TriggerEdge{150ms, 0, kUp}));
}

TEST(Debouncer, WithoutSettlingTimeEveryChangeCounts) {
  Debouncer debouncer(0ms, kUp);
  EXPECT_THAT(debounced(debouncer, {{1ms, kDown}, {2ms, kUp}}),
              ElementsAre(TriggerEdge{1ms, 0, kDown}, TriggerEdge{2ms, 0, kUp}));
}

TEST(Debouncer, TimeThatGoesBackCountsAsTheSame) {
  Debouncer debouncer(10ms, kUp);
  EXPECT_FALSE(debouncer.feed(100ms, kDown));
  EXPECT_FALSE(debouncer.feed(99ms, kUp));
  EXPECT_FALSE(debouncer.feed(98ms, kDown));
  EXPECT_EQ(debouncer.deadline(), 110ms);
  EXPECT_EQ(debouncer.settle(110ms), (TriggerEdge{100ms, 0, kDown}));
}

TEST(Debouncer, AButtonHeldAtTheStartCountsFromItsRelease) {
  Debouncer debouncer(10ms, kDown);
  EXPECT_THAT(debounced(debouncer, {{5ms, kUp}, {100ms, kDown}}),
              ElementsAre(TriggerEdge{5ms, 0, kUp}, TriggerEdge{100ms, 0, kDown}));
}

/// A hundred presses, each with up to seven bounces and sparks between them: exactly the hundred
/// come out, at the times of their first touch.
TEST(Debouncer, FindsExactlyThePressesThatWereMeant) {
  std::mt19937 random(7);
  std::uniform_int_distribution<int> bounces(0, 3);
  std::uniform_int_distribution<std::int64_t> gap_us(50, 4000);
  std::vector<Raw> edges;
  std::vector<TriggerEdge> meant;
  nanoseconds time = 1s;
  for (int i = 0; i < 200; ++i) {
    const TriggerAction action = i % 2 == 0 ? kDown : kUp;
    const TriggerAction other = i % 2 == 0 ? kUp : kDown;
    meant.push_back({time, 0, action});
    edges.push_back({time, action});
    for (int b = bounces(random); b > 0; --b) {
      edges.push_back({time += std::chrono::microseconds(gap_us(random)), other});
      edges.push_back({time += std::chrono::microseconds(gap_us(random)), action});
    }
    time += 40ms;
    edges.push_back({time, other});  // a spark
    edges.push_back({time += 300us, action});
    time += 40ms;
  }
  Debouncer debouncer(10ms, kUp);
  EXPECT_EQ(debounced(debouncer, edges), meant);
}

}  // namespace
}  // namespace trigmesh
