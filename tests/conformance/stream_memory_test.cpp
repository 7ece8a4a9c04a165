// What every selector of a stream keeps to: a frame that is not kept takes no memory, once buffers
// for those that wait are there.

#include <algorithm>
#include <cstdlib>

#include <gtest/gtest.h>

#include "firmware/daemon/keyframe_stream.hpp"
#include "firmware/daemon/sharpest_of_group.hpp"
#include "tests/conformance/allocation_counter.hpp"
#include "tests/support/panning_camera.hpp"

namespace trigmesh {
namespace {

using conformance::allocations_of_this_thread;
using std::chrono::milliseconds;

constexpr milliseconds kInterval(33);
constexpr int kWalk = 400;  // pixels there and back
constexpr int kStep = 4;

/// Most calls of operator new with one frame that was not kept, after the first three hundred.
std::uint64_t most_allocations(StreamSelector& selector) {
  test_support::PanningCamera camera(kWalk);
  StreamChoice choice;
  std::uint64_t most = 0;
  selector.begin({});
  for (int i = 0; i < 600; ++i) {
    const Frame frame = camera.at(std::abs(i * kStep % (2 * kWalk) - kWalk));
    const std::chrono::nanoseconds time = i * kInterval;
    const std::uint64_t before = allocations_of_this_thread().value();
    selector.offer(frame, {time, time, time}, static_cast<std::uint64_t>(i), choice);
    const std::uint64_t taken = allocations_of_this_thread().value() - before;
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
