#include "drivers/camera/frame_sequence.hpp"

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

TEST(FrameSequence, BeginsAtZeroWhateverTheDriverSays) {
  FrameSequence sequence;
  const auto first = sequence.place(917);
  EXPECT_EQ(first.sequence, 0U);
  EXPECT_EQ(first.missed_before, 0U);
  EXPECT_EQ(sequence.place(918).sequence, 1U);
}

TEST(FrameSequence, CountsWhatIsMissing) {
  FrameSequence sequence;
  (void)sequence.place(10);
  const auto later = sequence.place(14);
  EXPECT_EQ(later.sequence, 4U);
  EXPECT_EQ(later.missed_before, 3U);
}

TEST(FrameSequence, GoesOnAcrossTheWrap) {
  FrameSequence sequence;
  (void)sequence.place(0xFFFFFFFEU);
  EXPECT_EQ(sequence.place(0xFFFFFFFFU).sequence, 1U);
  const auto wrapped = sequence.place(1U);
  EXPECT_EQ(wrapped.sequence, 3U);
  EXPECT_EQ(wrapped.missed_before, 1U);
}

TEST(FrameSequence, TakesANumberThatDoesNotGoUpAsTheNext) {
  FrameSequence sequence;
  (void)sequence.place(5);
  const auto same = sequence.place(5);
  EXPECT_EQ(same.sequence, 1U);
  EXPECT_EQ(same.missed_before, 0U);
  const auto back = sequence.place(2);
  EXPECT_EQ(back.sequence, 2U);
  EXPECT_EQ(back.missed_before, 0U);
}

}  // namespace
}  // namespace trigmesh
