#include "firmware/daemon/still_shelf.hpp"

#include <chrono>
#include <optional>

#include <gtest/gtest.h>

#include "tests/unit/firmware/daemon/test_frames.hpp"

namespace trigmesh {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr SessionSerial kSerial{3};

/// Frames every 10 ms; frame n at 10 n ms.
class StillShelfTest : public ::testing::Test {
 protected:
  void frames_until(std::uint64_t last) {
    for (; next_ <= last; ++next_) {
      const Frame frame = frames_.make(static_cast<std::uint8_t>(next_));
      offered_ = shelf_.offer(frame, test_support::at(next_ * milliseconds(10)), next_) && offered_;
    }
  }

  void take(nanoseconds press) { shelf_.take(kSerial, StillTicket{++ticket_}, press); }

  /// The sequence of the one answer; nothing: there is none, or it has no frame.
  std::optional<std::uint64_t> taken() {
    const std::vector<StillResult> results = shelf_.take_results();
    EXPECT_EQ(results.size(), 1U);
    return results.size() == 1 && results[0].frame ? std::optional(results[0].frame->sequence)
                                                   : std::nullopt;
  }

  test_support::TestFrames frames_;
  FrameCopies copies_{8};
  StillShelf shelf_{{.history = 4, .wait = milliseconds(100)}, copies_};
  std::uint64_t next_ = 0;
  std::uint64_t ticket_ = 0;
  bool offered_ = true;
};

TEST_F(StillShelfTest, GivesTheFirstFrameThatIsNotBeforeThePress) {
  frames_until(9);
  shelf_.expect(milliseconds(75));  // heard of late
  frames_until(30);                 // the copies of then are gone
  take(milliseconds(75));
  EXPECT_EQ(taken(), 8U);
}

TEST_F(StillShelfTest, NeverGivesAFrameFromBeforeThePress) {
  frames_until(9);
  shelf_.expect(milliseconds(91));
  take(milliseconds(91));
  EXPECT_TRUE(shelf_.take_results().empty()) << "waits for the next frame";
  frames_until(10);
  EXPECT_EQ(taken(), 10U);
}

TEST_F(StillShelfTest, TheCopyHasTheBytesOfTheFrame) {
  shelf_.expect(milliseconds(0));
  frames_until(0);
  take(milliseconds(0));
  const auto results = shelf_.take_results();
  ASSERT_EQ(results.size(), 1U);
  ASSERT_TRUE(results[0].frame);
  const auto bytes = results[0].frame->frame.bytes();
  EXPECT_EQ(std::vector<std::uint8_t>(bytes.begin(), bytes.end()), test_support::grey_lines(0));
}

TEST_F(StillShelfTest, AForgottenPressGivesItsCopyBack) {
  frames_until(9);
  shelf_.expect(milliseconds(75));
  shelf_.expect(milliseconds(85));
  shelf_.forget(milliseconds(85));  // they were a double press
  EXPECT_TRUE(shelf_.take_results().empty());
  frames_until(30);
  EXPECT_EQ(copies_.out_count(), 4U) << "the history alone";
}

TEST_F(StillShelfTest, AStillThatWasAskedForIsNotForgotten) {
  frames_until(9);
  shelf_.expect(milliseconds(75));
  take(milliseconds(75));
  shelf_.forget(milliseconds(75));
  EXPECT_EQ(taken(), 8U);
}

TEST_F(StillShelfTest, WorksForCommandsThatWereNotExpected) {
  frames_until(9);
  take(milliseconds(95));
  frames_until(10);
  EXPECT_EQ(taken(), 10U);
}

TEST_F(StillShelfTest, EachPressGetsAFrameOfItsOwn) {
  frames_until(9);
  take(milliseconds(75));
  take(milliseconds(76));
  const auto results = shelf_.take_results();
  ASSERT_EQ(results.size(), 2U);
  EXPECT_EQ(results[0].frame->sequence, 8U);
  EXPECT_EQ(results[1].frame->sequence, 9U);
}

TEST_F(StillShelfTest, AnUndecidedPressHoldsUpNoLaterOne) {
  frames_until(9);
  shelf_.expect(milliseconds(75));  // the button is still down
  take(milliseconds(85));           // a command
  EXPECT_EQ(taken(), 9U);
}

TEST_F(StillShelfTest, APressWithoutAFrameIsMissed) {
  take(milliseconds(10));
  EXPECT_EQ(shelf_.deadline(), milliseconds(110));
  shelf_.on_time(milliseconds(111));
  EXPECT_EQ(taken(), std::nullopt);
}

TEST_F(StillShelfTest, IsBoundedWhenTheStorageHasAllCopies) {
  std::vector<StillResult> storage;
  for (int i = 0; i < 20; ++i) {  // nothing is ever stored
    take(milliseconds(10) * i);
    frames_until(static_cast<std::uint64_t>(i));
    for (StillResult& result : shelf_.take_results()) {
      storage.push_back(std::move(result));
    }
  }
  EXPECT_FALSE(offered_) << "the caller counts it";
  EXPECT_EQ(copies_.out_count(), copies_.capacity());
  storage.clear();
  frames_until(23);  // those that had no copy are waited for a little
  EXPECT_FALSE(shelf_.take_results().empty()) << "goes on when the storage does";
}

TEST_F(StillShelfTest, WithoutHistoryNothingIsCopiedUntilAPressWaits) {
  StillShelf shelf({.history = 0, .wait = milliseconds(100)}, copies_);
  for (std::uint64_t i = 0; i < 5; ++i) {
    EXPECT_TRUE(shelf.offer(frames_.make(0), test_support::at(i * milliseconds(10)), i));
  }
  EXPECT_EQ(copies_.out_count(), 0U);
  shelf.take(kSerial, StillTicket{1}, milliseconds(45));
  EXPECT_TRUE(shelf.offer(frames_.make(0), test_support::at(milliseconds(50)), 5));
  EXPECT_TRUE(shelf.offer(frames_.make(0), test_support::at(milliseconds(60)), 6));
  EXPECT_TRUE(shelf.offer(frames_.make(0), test_support::at(milliseconds(70)), 7));
  const auto results = shelf.take_results();
  ASSERT_EQ(results.size(), 1U);
  EXPECT_EQ(results[0].frame->sequence, 5U);
}

}  // namespace
}  // namespace trigmesh
