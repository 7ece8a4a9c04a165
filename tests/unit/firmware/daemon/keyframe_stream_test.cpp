#include "firmware/daemon/keyframe_stream.hpp"

#include <chrono>
#include <memory>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/camera/slot_pool.hpp"
#include "tests/support/panning_camera.hpp"
#include "tests/unit/firmware/daemon/test_frames.hpp"

namespace trigmesh {
namespace {

using std::chrono::milliseconds;
using test_support::PanningCamera;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

constexpr milliseconds kInterval(33);

class KeyframeStreamTest : public ::testing::Test {
 protected:
  /// Frames of a pan of `step_px` a frame.
  void walk(KeyframeStream& stream, int frames, int step_px) {
    PanningCamera pan(frames * step_px);
    for (int i = 0; i < frames; ++i) {
      offer(stream,
            pan.at(i * step_px),
            test_support::at(interval_ * (i + 1)),
            static_cast<std::uint64_t>(i));
    }
    end(stream);
  }

  void offer(KeyframeStream& stream,
             const Frame& frame,
             const FrameTimes& times,
             std::uint64_t sequence) {
    StreamChoice choice;
    stream.offer(frame, times, sequence, choice);
    use(choice);
  }

  void end(KeyframeStream& stream) {
    StreamChoice choice;
    stream.end(choice);
    use(choice);
  }

  void use(const StreamChoice& choice) {
    for (const TimedFrame& frame : choice.kept) {
      kept_.push_back(frame.sequence);
    }
    judged_.insert(judged_.end(), choice.judged.begin(), choice.judged.end());
  }

  FrameCopies copies_{most_waiting_keyframes({}, kInterval)};
  std::chrono::nanoseconds interval_ = kInterval;
  std::vector<std::uint64_t> kept_;
  std::vector<FrameJudged> judged_;
};

TEST_F(KeyframeStreamTest, KeepsKeyframesAndJudgesEveryFrameOnce) {
  KeyframeStream stream({}, copies_);
  stream.begin(milliseconds(0));
  walk(stream, 60, 3);
  EXPECT_THAT(judged_, SizeIs(60));
  EXPECT_LT(kept_.front(), 10U) << "the sharpest of those around the press";
  EXPECT_GE(kept_.size(), 4U);
  EXPECT_LE(kept_.size(), 20U);
  EXPECT_TRUE(std::is_sorted(kept_.begin(), kept_.end()));
  EXPECT_EQ(stream.counts().seen, 60U);
  EXPECT_EQ(stream.counts().kept, kept_.size());
  EXPECT_EQ(stream.counts().kept + stream.counts().not_chosen, 60U);
  EXPECT_EQ(copies_.out_count(), 0U) << "every buffer is free again";
}

TEST_F(KeyframeStreamTest, ACameraThatStandsStillKeepsOneFrame) {
  KeyframeStream stream({}, copies_);
  stream.begin(milliseconds(0));
  walk(stream, 30, 0);
  EXPECT_THAT(kept_, ElementsAre(0));
}

TEST_F(KeyframeStreamTest, FramesFromBeforeTheStreamDoNotBelongToIt) {
  KeyframeStream stream({}, copies_);
  stream.begin(10 * kInterval);
  walk(stream, 20, 3);
  EXPECT_THAT(judged_, SizeIs(11));
  EXPECT_EQ(judged_.front().sensor_sequence, 9U);
  EXPECT_GE(kept_.front(), 9U);
}

TEST_F(KeyframeStreamTest, EachStreamBeginsAnew) {
  KeyframeStream stream({}, copies_);
  for (int i = 0; i < 2; ++i) {
    stream.begin(milliseconds(0));
    kept_.clear();
    walk(stream, 10, 0);
    EXPECT_THAT(kept_, ElementsAre(0));
  }
}

TEST_F(KeyframeStreamTest, WithoutABufferAFrameIsCountedAndTheStreamGoesOn) {
  FrameCopies few(2);
  KeyframeStream stream({}, few);
  stream.begin(milliseconds(0));
  walk(stream, 60, 3);
  EXPECT_GT(stream.counts().no_buffer, 0U);
  EXPECT_THAT(kept_, Not(IsEmpty()));
  EXPECT_EQ(judged_.size() + stream.counts().no_buffer, 60U);
  EXPECT_EQ(few.out_count(), 0U);
}

TEST_F(KeyframeStreamTest, TheCopiesThatAreAskedForAreEnough) {
  for (const int step_px : {0, 1, 3, 12}) {
    KeyframeStream stream({}, copies_);
    stream.begin(milliseconds(0));
    walk(stream, 60, step_px);
    EXPECT_EQ(stream.counts().no_buffer, 0U) << step_px << " pixels a frame";
  }
}

TEST_F(KeyframeStreamTest, ACameraThatIsFasterThanExpectedIsFollowedToo) {
  KeyframeOptions options;
  options.max_waiting = copies_.capacity();
  KeyframeStream stream(options, copies_);
  stream.begin(milliseconds(0));
  interval_ = kInterval / 8;
  walk(stream, 120, 3);
  EXPECT_EQ(stream.counts().no_buffer, 0U);
  EXPECT_GE(stream.counts().kept, 3U);
}

TEST_F(KeyframeStreamTest, DamagedFramesAndTimesThatDoNotRiseAreCounted) {
  KeyframeStream stream({}, copies_);
  stream.begin(milliseconds(0));
  PanningCamera pan(10);
  offer(stream, pan.at(0), test_support::at(milliseconds(50)), 0);
  offer(stream, pan.at(3), test_support::at(milliseconds(50)), 1);
  auto pool = std::make_shared<SlotPool>(1, nullptr);
  const std::size_t slot = *pool->take();
  FrameInfo info;
  info.layout.format = PixelFormat::kJpeg;
  offer(stream, Frame(info, pool->bytes(slot), pool, slot), test_support::at(milliseconds(90)), 2);
  end(stream);
  EXPECT_EQ(stream.counts().damaged, 2U);
  EXPECT_THAT(kept_, ElementsAre(0));
}

}  // namespace
}  // namespace trigmesh
