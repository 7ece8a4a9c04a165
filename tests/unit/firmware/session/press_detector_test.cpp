#include "firmware/session/press_detector.hpp"

#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using ::testing::ElementsAre;

Press press(PressKind kind, int ms) {
  return {kind, milliseconds(ms)};
}

/// Presses, without kDown and kUp, of edges at these times; press and release take turns.
std::vector<Press> presses_of(const std::vector<int>& edges_ms, const PressOptions& options = {}) {
  PressDetector detector(options);
  std::vector<Press> all;
  const auto take = [&](const std::vector<Press>& some) {
    for (const Press& one : some) {
      if (one.kind != PressKind::kDown && one.kind != PressKind::kUp) {
        all.push_back(one);
      }
    }
  };
  bool down = false;
  for (const int ms : edges_ms) {
    down = !down;
    take(detector.on_edge(
        {down ? EdgeDirection::kPress : EdgeDirection::kRelease, milliseconds(ms)}));
  }
  take(detector.on_time(milliseconds(1'000'000)));
  return all;
}

TEST(PressDetector, TellsShortLongAndDouble) {
  EXPECT_THAT(presses_of({100, 200}), ElementsAre(press(PressKind::kShort, 100)));
  EXPECT_THAT(presses_of({100, 1100}), ElementsAre(press(PressKind::kLong, 100)));
  EXPECT_THAT(presses_of({100, 200, 400, 500}), ElementsAre(press(PressKind::kDouble, 100)));
}

TEST(PressDetector, DecidesAtTheLimits) {
  EXPECT_THAT(presses_of({100, 1099}), ElementsAre(press(PressKind::kShort, 100)));
  EXPECT_THAT(presses_of({100, 200, 500, 600}), ElementsAre(press(PressKind::kDouble, 100)));
  EXPECT_THAT(presses_of({100, 200, 501, 600}),
              ElementsAre(press(PressKind::kShort, 100), press(PressKind::kShort, 501)));
}

TEST(PressDetector, AShortAndALongPressStayTwo) {
  EXPECT_THAT(presses_of({100, 200, 300, 1400}),
              ElementsAre(press(PressKind::kShort, 100), press(PressKind::kLong, 300)));
}

TEST(PressDetector, TellsALongPressWhileTheButtonIsDown) {
  PressDetector detector({});
  EXPECT_THAT(detector.on_edge({EdgeDirection::kPress, milliseconds(100)}),
              ElementsAre(press(PressKind::kDown, 100)));
  EXPECT_EQ(detector.deadline(), milliseconds(1100));
  EXPECT_THAT(detector.on_time(milliseconds(1099)), ElementsAre());
  EXPECT_THAT(detector.on_time(milliseconds(1100)), ElementsAre(press(PressKind::kLong, 100)));
  EXPECT_EQ(detector.deadline(), std::nullopt);
  EXPECT_THAT(detector.on_edge({EdgeDirection::kRelease, milliseconds(1200)}),
              ElementsAre(press(PressKind::kUp, 1200)));
}

TEST(PressDetector, WithoutDoublePressesAShortOneIsToldAtOnce) {
  EXPECT_THAT(presses_of({100, 200, 300, 400}, {.double_press = nanoseconds(0)}),
              ElementsAre(press(PressKind::kShort, 100), press(PressKind::kShort, 300)));
}

TEST(PressDetector, SurvivesLostEdgesAndTimesThatGoBack) {
  PressDetector detector({});
  EXPECT_THAT(detector.on_edge({EdgeDirection::kRelease, milliseconds(50)}), ElementsAre());
  EXPECT_EQ(detector.stray_edges(), 1U);
  (void)detector.on_edge({EdgeDirection::kPress, milliseconds(100)});
  EXPECT_THAT(detector.on_edge({EdgeDirection::kPress, milliseconds(90)}),
              ElementsAre(press(PressKind::kUp, 100), press(PressKind::kDown, 100)));
}

TEST(PressDetector, AccountsForEveryPressEdge) {
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    std::mt19937_64 random(seed);
    PressDetector detector({});
    std::int64_t now_ms = 0;
    std::size_t edges = 0;
    std::size_t downs = 0;
    std::size_t accounted = 0;
    const auto count = [&](const std::vector<Press>& presses) {
      for (const Press& one : presses) {
        downs += one.kind == PressKind::kDown ? 1U : 0U;
        accounted += one.kind == PressKind::kShort || one.kind == PressKind::kLong ? 1U : 0U;
        accounted += one.kind == PressKind::kDouble ? 2U : 0U;
      }
    };
    for (int i = 0; i < 100; ++i) {
      now_ms += static_cast<std::int64_t>(random() % 600);
      const bool is_press = random() % 2 == 0;
      edges += is_press ? 1U : 0U;
      count(detector.on_edge(
          {is_press ? EdgeDirection::kPress : EdgeDirection::kRelease, milliseconds(now_ms)}));
      if (random() % 3 == 0) {
        count(detector.on_time(milliseconds(now_ms + 100)));
      }
    }
    count(detector.on_edge({EdgeDirection::kRelease, milliseconds(now_ms + 200)}));
    count(detector.on_time(milliseconds(now_ms + 10'000)));
    EXPECT_EQ(downs, edges) << "seed " << seed;
    EXPECT_EQ(accounted, edges) << "seed " << seed;
  }
}

TEST(PressDetector, ChecksItsOptions) {
  EXPECT_FALSE(PressOptions{.long_press = nanoseconds(0)}.validate());
  EXPECT_FALSE(PressOptions{.double_press = nanoseconds(-1)}.validate());
  EXPECT_TRUE(PressOptions{}.validate());
}

}  // namespace
}  // namespace trigmesh
