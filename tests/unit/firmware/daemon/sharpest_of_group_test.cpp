#include "firmware/daemon/sharpest_of_group.hpp"

#include <chrono>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/firmware/daemon/test_frames.hpp"

namespace trigmesh {
namespace {

using std::chrono::milliseconds;
using ::testing::ElementsAre;

/// Offers frames of these contrasts at 0, 10, 20 ms .. and ends; the sequences that are kept.
std::vector<std::uint64_t> kept(SharpestOfGroup& selector, const std::vector<int>& contrasts) {
  test_support::TestFrames frames;
  std::vector<std::uint64_t> sequences;
  StreamChoice choice;
  for (std::uint64_t i = 0; i < contrasts.size(); ++i) {
    const Frame frame = frames.make(static_cast<std::uint8_t>(contrasts[i]));
    selector.offer(frame, test_support::at(i * milliseconds(10)), i, choice);
  }
  selector.end(choice);
  for (const TimedFrame& one : choice.kept) {
    sequences.push_back(one.sequence);
  }
  return sequences;
}

TEST(SharpestOfGroup, KeepsTheSharpestOfEachGroup) {
  FrameCopies copies(4);
  SharpestOfGroup selector(3, copies);
  selector.begin(milliseconds(0));
  EXPECT_THAT(kept(selector, {10, 50, 20, 40, 30, 20}), ElementsAre(1, 3));
  EXPECT_EQ(selector.counts().seen, 6U);
  EXPECT_EQ(selector.counts().kept, 2U);
  EXPECT_EQ(selector.counts().not_chosen, 4U);
}

TEST(SharpestOfGroup, TheFirstOfEquallySharpOnesIsKept) {
  FrameCopies copies(4);
  SharpestOfGroup selector(3, copies);
  selector.begin(milliseconds(0));
  EXPECT_THAT(kept(selector, {10, 10, 10}), ElementsAre(0));
}

TEST(SharpestOfGroup, GroupsOfOneKeepEverything) {
  FrameCopies copies(4);
  SharpestOfGroup selector(1, copies);
  selector.begin(milliseconds(0));
  EXPECT_THAT(kept(selector, {10, 5, 20}), ElementsAre(0, 1, 2));
}

TEST(SharpestOfGroup, ALastGroupCountsFromHalfItsFramesOn) {
  FrameCopies copies(4);
  SharpestOfGroup selector(4, copies);
  selector.begin(milliseconds(0));
  EXPECT_THAT(kept(selector, {10, 50, 20, 10, 90}), ElementsAre(1));
  selector.begin(milliseconds(0));
  EXPECT_THAT(kept(selector, {10, 50, 20, 10, 90, 20}), ElementsAre(1, 4));
}

TEST(SharpestOfGroup, AShortStreamKeepsOne) {
  FrameCopies copies(4);
  SharpestOfGroup selector(10, copies);
  selector.begin(milliseconds(0));
  EXPECT_THAT(kept(selector, {10}), ElementsAre(0));
}

TEST(SharpestOfGroup, FramesFromBeforeTheStreamDoNotBelongToIt) {
  FrameCopies copies(4);
  SharpestOfGroup selector(1, copies);
  selector.begin(milliseconds(15));
  EXPECT_THAT(kept(selector, {10, 10, 10}), ElementsAre(2));
}

TEST(SharpestOfGroup, CountsWhatHasNoBuffer) {
  FrameCopies copies(1);
  const Frame held = copies.copy(test_support::TestFrames().make(0), 0);
  SharpestOfGroup selector(1, copies);
  selector.begin(milliseconds(0));
  EXPECT_TRUE(kept(selector, {10, 10}).empty());
  EXPECT_EQ(selector.counts().no_buffer, 2U);
}

TEST(SharpestOfGroup, CountsDamagedFrames) {
  FrameCopies copies(2);
  SharpestOfGroup selector(2, copies);
  selector.begin(milliseconds(0));
  auto pool = std::make_shared<SlotPool>(1, nullptr);
  const std::size_t slot = *pool->take();
  FrameInfo info;
  info.layout.format = PixelFormat::kJpeg;
  const Frame damaged(info, pool->bytes(slot), pool, slot);
  StreamChoice choice;
  selector.offer(damaged, test_support::at(milliseconds(1)), 1, choice);
  EXPECT_EQ(selector.counts().damaged, 1U);
  selector.end(choice);
  EXPECT_TRUE(choice.kept.empty());
}

}  // namespace
}  // namespace trigmesh
