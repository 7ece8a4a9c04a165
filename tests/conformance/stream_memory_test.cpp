// What every selector of a stream keeps to: a frame that is not kept takes no memory, once buffers
// for those that wait are there.

#include <algorithm>

#include <gtest/gtest.h>

#include "firmware/daemon/keyframe_stream.hpp"
#include "firmware/daemon/sharpest_of_group.hpp"
#include "tests/conformance/allocation_counter.hpp"
#include "tests/support/textured_image.hpp"

namespace trigmesh {
namespace {

using conformance::allocations_of_this_thread;
using std::chrono::milliseconds;

constexpr milliseconds kInterval(33);

/// A camera before a wall along which it goes to and fro.
class Walk {
 public:
  Frame frame(int index) {
    const int x_px = std::abs(index * kStep % (2 * kLength) - kLength);
    const std::size_t slot = *pool_->take();
    const cv::Mat view = wall_(cv::Rect(x_px, 0, kWidth, kHeight));
    pool_->bytes(slot).resize(view.total());
    view.copyTo(cv::Mat(kHeight, kWidth, CV_8UC1, pool_->bytes(slot).data()));
    FrameInfo info;
    info.layout.format = PixelFormat::kGrey;
    info.layout.width_px = kWidth;
    info.layout.height_px = kHeight;
    info.layout.stride_bytes = kWidth;
    return {info, pool_->bytes(slot), pool_, slot};
  }

 private:
  static constexpr int kWidth = 320;
  static constexpr int kHeight = 240;
  static constexpr int kLength = 400;
  static constexpr int kStep = 4;

  cv::Mat wall_ = test_support::textured_image(kWidth + kLength, kHeight, 5);
  std::shared_ptr<SlotPool> pool_ = std::make_shared<SlotPool>(1, nullptr);
};

/// Most calls of operator new with one frame that was not kept, after the first three hundred.
std::uint64_t most_allocations(StreamSelector& selector) {
  Walk walk;
  StreamChoice choice;
  std::uint64_t most = 0;
  selector.begin({});
  for (int i = 0; i < 600; ++i) {
    const Frame frame = walk.frame(i);
    const std::chrono::nanoseconds time = i * kInterval;
    const std::uint64_t before = allocations_of_this_thread().value_or(0);
    selector.offer(frame, {time, time, time}, static_cast<std::uint64_t>(i), choice);
    const std::uint64_t taken = allocations_of_this_thread().value_or(0) - before;
    if (i >= 300 && choice.kept.empty()) {
      most = std::max(most, taken);
    }
    choice.kept.clear();
    choice.judged.clear();
  }
  EXPECT_GT(selector.counts().kept, 20U);
  EXPECT_GT(selector.counts().not_chosen, 300U);
  return most;
}

class StreamMemory : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!allocations_of_this_thread()) {
      GTEST_SKIP() << "allocations cannot be counted under a sanitizer";
    }
  }

  FrameCopies copies_{most_waiting_keyframes({}, kInterval)};
};

TEST_F(StreamMemory, KeyframesTakeItOnly) {
  KeyframeStream selector({}, copies_);
  EXPECT_EQ(most_allocations(selector), 0U);
}

TEST_F(StreamMemory, TheSharpestOfAGroupTakesNone) {
  SharpestOfGroup selector(5, copies_);
  EXPECT_EQ(most_allocations(selector), 0U);
}

}  // namespace
}  // namespace trigmesh
