#include "firmware/session/press_binding.hpp"

#include <algorithm>
#include <map>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// Frame k is exposed from 100 k to 100 k + 20 ms.
Exposure frame(std::uint64_t sequence) {
  const auto begin = milliseconds(100 * sequence);
  return {sequence, begin, begin + milliseconds(20)};
}

BoundPress bound(int ms, std::optional<std::uint64_t> sequence) {
  return {milliseconds(ms), sequence};
}

TEST(PressBinder, TakesTheFrameWhoseExposureContainsThePress) {
  PressBinder binder({});
  (void)binder.on_frame(frame(0));
  (void)binder.on_frame(frame(1));
  EXPECT_THAT(binder.on_press(milliseconds(110)), ElementsAre(bound(110, 1)));
}

TEST(PressBinder, TakesTheFrameThatFollowsThePressAndNeverAnEarlierOne) {
  PressBinder binder({});
  (void)binder.on_frame(frame(0));
  (void)binder.on_frame(frame(1));
  EXPECT_THAT(binder.on_press(milliseconds(121)), IsEmpty());
  EXPECT_THAT(binder.on_frame(frame(2)), ElementsAre(bound(121, 2)));
}

TEST(PressBinder, FindsTheFrameOfAPressThatIsToldLate) {
  PressBinder binder({});
  for (std::uint64_t i = 0; i < 10; ++i) {
    (void)binder.on_frame(frame(i));
  }
  EXPECT_THAT(binder.on_press(milliseconds(350)), ElementsAre(bound(350, 4)));
}

TEST(PressBinder, GivesEachPressAFrameOfItsOwn) {
  PressBinder binder({});
  (void)binder.on_frame(frame(0));
  EXPECT_THAT(binder.on_press(milliseconds(5)), ElementsAre(bound(5, 0)));
  EXPECT_THAT(binder.on_press(milliseconds(6)), IsEmpty());
  EXPECT_THAT(binder.on_frame(frame(1)), ElementsAre(bound(6, 1)));
}

TEST(PressBinder, WaitsForAFrameThatIsOutOfOrder) {
  PressBinder binder({});
  (void)binder.on_frame(frame(0));
  EXPECT_THAT(binder.on_press(milliseconds(50)), IsEmpty());
  EXPECT_THAT(binder.on_frame(frame(2)), IsEmpty()) << "frame 1 may still come";
  EXPECT_THAT(binder.on_frame(frame(1)), ElementsAre(bound(50, 1)));
}

TEST(PressBinder, DoesNotWaitForeverForAMissingFrame) {
  PressBinder binder({});
  (void)binder.on_frame(frame(0));
  (void)binder.on_press(milliseconds(50));
  (void)binder.on_frame(frame(2));
  EXPECT_THAT(binder.on_frame(frame(3)), IsEmpty());
  EXPECT_THAT(binder.on_frame(frame(4)), ElementsAre(bound(50, 2)));
}

TEST(PressBinder, GivesUpAfterTheWait) {
  PressBinder binder({});
  (void)binder.on_press(milliseconds(50));
  EXPECT_EQ(binder.deadline(), milliseconds(2050));
  EXPECT_THAT(binder.on_time(milliseconds(2050)), IsEmpty());
  EXPECT_THAT(binder.on_time(milliseconds(2051)), ElementsAre(bound(50, std::nullopt)));
  EXPECT_EQ(binder.deadline(), std::nullopt);
}

TEST(PressBinder, TakesAHeldBackFrameRatherThanNone) {
  PressBinder binder({});
  (void)binder.on_frame(frame(0));
  (void)binder.on_press(milliseconds(50));
  (void)binder.on_frame(frame(2));
  EXPECT_THAT(binder.on_time(milliseconds(2051)), ElementsAre(bound(50, 2)));
}

TEST(PressBinder, AnswersEveryPressWhenTheCameraStops) {
  PressBinder binder({});
  (void)binder.on_frame(frame(0));
  (void)binder.on_press(milliseconds(50));
  (void)binder.on_press(milliseconds(60));
  (void)binder.on_frame(frame(2));
  EXPECT_THAT(binder.finish(), ElementsAre(bound(50, 2), bound(60, std::nullopt)));
  EXPECT_THAT(binder.on_frame(frame(0)), IsEmpty()) << "the sensor begins to count again";
  EXPECT_THAT(binder.on_press(milliseconds(5)), ElementsAre(bound(5, 0)));
}

TEST(PressBinder, LeavesOutFramesThatCameBefore) {
  PressBinder binder({});
  (void)binder.on_frame(frame(0));
  EXPECT_THAT(binder.on_press(milliseconds(5)), ElementsAre(bound(5, 0)));
  EXPECT_THAT(binder.on_press(milliseconds(6)), IsEmpty());
  EXPECT_THAT(binder.on_frame(frame(0)), IsEmpty());
}

TEST(PressBinder, ChecksItsOptions) {
  EXPECT_FALSE(PressBindingOptions{.wait = nanoseconds(0)}.validate());
  EXPECT_FALSE((PressBindingOptions{.history = 2, .reorder = 2}.validate()));
  EXPECT_TRUE(PressBindingOptions{}.validate());
}

/// The answer by looking at everything at once.
std::map<nanoseconds, std::optional<std::uint64_t>> brute_force(
    const std::vector<nanoseconds>& presses, const std::vector<Exposure>& frames) {
  std::map<nanoseconds, std::optional<std::uint64_t>> answers;
  std::size_t next = 0;
  for (const nanoseconds press : presses) {
    while (next < frames.size() && frames[next].end < press) {
      ++next;
    }
    answers[press] = next < frames.size() ? std::optional(frames[next++].sequence) : std::nullopt;
  }
  return answers;
}

TEST(PressBinder, GivesTheSameAnswerInWhateverOrderThingsArrive) {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    std::mt19937_64 random(seed);
    std::vector<Exposure> frames;  // some are missing
    for (std::uint64_t i = 0; i < 30; ++i) {
      if (random() % 5 != 0) {
        frames.push_back(frame(i));
      }
    }
    std::vector<nanoseconds> presses;
    for (int i = 0; i < 6; ++i) {
      presses.push_back(milliseconds(static_cast<int>(random() % 2900)) + nanoseconds(i));
    }
    std::sort(presses.begin(), presses.end());
    std::vector<Exposure> arrival = frames;
    for (std::size_t i = 0; i + 1 < arrival.size(); i += 2) {  // neighbours in the wrong order
      if (random() % 2 == 0 && arrival[i + 1].sequence - arrival[i].sequence == 1) {
        std::swap(arrival[i], arrival[i + 1]);
      }
    }
    PressBinder binder({});
    std::map<nanoseconds, std::optional<std::uint64_t>> answers;
    const auto take = [&](const std::vector<BoundPress>& some) {
      for (const BoundPress& one : some) {
        answers[one.press_time] = one.sequence;
      }
    };
    std::size_t next_press = 0;
    for (const Exposure& exposure : arrival) {
      take(binder.on_frame(exposure));
      // A press is told up to 800 ms late, but in order.
      while (next_press < presses.size() &&
             presses[next_press] + milliseconds(static_cast<int>(random() % 800)) < exposure.end) {
        take(binder.on_press(presses[next_press++]));
      }
    }
    while (next_press < presses.size()) {
      take(binder.on_press(presses[next_press++]));
    }
    take(binder.finish());
    EXPECT_EQ(answers, brute_force(presses, frames)) << "seed " << seed;
  }
}

}  // namespace
}  // namespace trigmesh
