#include "drivers/camera/libcamera/frame_exchange.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <deque>
#include <thread>
#include <utility>

#include <poll.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/drivers/camera/libcamera/memory_file.hpp"

namespace trigmesh {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr std::size_t kSize = 64;

std::shared_ptr<FrameExchange> make_exchange(std::size_t count) {
  std::vector<MappedPlanes> memory;
  for (std::size_t slot = 0; slot < count; ++slot) {
    const test_support::MemoryFile file(
        std::vector<std::uint8_t>(kSize, static_cast<std::uint8_t>(slot)));
    const PlanePlace planes[] = {{file.fd(), 0, kSize}};
    auto mapped = MappedPlanes::map(planes, kSize, "test");
    EXPECT_TRUE(mapped);
    memory.push_back(*std::move(mapped));
  }
  return std::make_shared<FrameExchange>(std::move(memory));
}

FilledSlot filled(std::size_t slot, std::uint32_t sequence) {
  FilledSlot result;
  result.slot = slot;
  result.bytes_used = kSize;
  result.sequence = sequence;
  return result;
}

/// Plays the camera: fills what it has in order.
class FrameExchangeTest : public ::testing::Test {
 protected:
  void begin(std::size_t count) {
    exchange_ = make_exchange(count);
    ASSERT_TRUE(exchange_->begin([this](std::size_t slot) {
      queued_.push_back(slot);
      return true;
    }));
  }

  void fill() {
    const std::size_t slot = queued_.front();
    queued_.pop_front();
    exchange_->on_filled(filled(slot, sequence_++));
  }

  [[nodiscard]] Frame frame() {
    const std::optional<FilledSlot> taken = exchange_->take();
    EXPECT_TRUE(taken);
    return {FrameInfo{}, exchange_->memory(taken->slot), exchange_, taken->slot};
  }

  std::deque<std::size_t> queued_;
  std::uint32_t sequence_ = 0;
  std::shared_ptr<FrameExchange> exchange_;
};

TEST_F(FrameExchangeTest, HandsAllBuffersToTheCameraAndGivesWhatItFilledInOrder) {
  begin(4);
  EXPECT_THAT(queued_, ElementsAre(0U, 1U, 2U, 3U));
  EXPECT_FALSE(exchange_->take());
  fill();
  fill();
  EXPECT_EQ(exchange_->take()->sequence, 0U);
  EXPECT_EQ(exchange_->take()->sequence, 1U);
  EXPECT_FALSE(exchange_->take());
  EXPECT_EQ(exchange_->queued_count(), 2U);
}

TEST_F(FrameExchangeTest, ABufferThatComesBackGoesToTheCameraWithTheNextFrame) {
  begin(4);
  fill();
  frame().release();
  EXPECT_THAT(queued_, ElementsAre(1U, 2U, 3U)) << "the camera has enough; no work for our thread";
  fill();
  EXPECT_THAT(queued_, ElementsAre(2U, 3U, 0U));
}

TEST_F(FrameExchangeTest, AStarvedCameraGetsABufferAtOnce) {
  begin(3);
  fill();
  fill();
  Frame first = frame();
  Frame second = frame();
  fill();
  EXPECT_THAT(queued_, IsEmpty());
  first.release();
  EXPECT_THAT(queued_, ElementsAre(0U));
  second.release();
  EXPECT_THAT(queued_, ElementsAre(0U, 1U));
}

TEST_F(FrameExchangeTest, WakesWhoWaits) {
  begin(3);
  EXPECT_FALSE(exchange_->ready().is_set());
  fill();
  EXPECT_TRUE(exchange_->ready().is_set());
  exchange_->ready().clear();
  exchange_->on_gone();
  EXPECT_TRUE(exchange_->ready().is_set());
  EXPECT_TRUE(exchange_->is_gone());
  EXPECT_TRUE(exchange_->take()) << "what was filled before is still delivered";
}

TEST_F(FrameExchangeTest, FramesStayReadableAfterTheEnd) {
  begin(3);
  fill();
  fill();
  Frame held = frame();
  exchange_->end();
  EXPECT_EQ(held.bytes()[0], 0);
  EXPECT_FALSE(exchange_->take()) << "what nobody took is gone";
  EXPECT_TRUE(exchange_->memory(1).empty());
  const std::size_t queued = queued_.size();
  exchange_.reset();
  EXPECT_EQ(held.bytes()[kSize - 1], 0) << "the frame keeps the exchange";
  held.release();
  EXPECT_EQ(queued_.size(), queued) << "nothing goes to a camera that was stopped";
}

TEST_F(FrameExchangeTest, NothingGoesToACameraThatWent) {
  begin(3);
  fill();
  Frame held = frame();
  exchange_->on_gone();
  const std::size_t queued = queued_.size();
  held.release();
  EXPECT_EQ(queued_.size(), queued);
}

TEST_F(FrameExchangeTest, KeepsWhatNobodyTakesUnlessItIsToRenew) {
  begin(3);
  fill();
  fill();
  fill();
  EXPECT_EQ(exchange_->queued_count(), 0U) << "the camera stands still and loses new frames";
  EXPECT_EQ(exchange_->take()->sequence, 0U);
  exchange_->give_back(0);
  exchange_->set_when_full(FullExchange::kRenew);
  fill();
  EXPECT_EQ(exchange_->queued_count(), 1U) << "the oldest went back";
  EXPECT_EQ(exchange_->take()->sequence, 2U);
}

TEST_F(FrameExchangeTest, ForgetsWhatIsFilledWhenAsked) {
  begin(4);
  fill();
  fill();
  exchange_->discard_filled();
  EXPECT_EQ(exchange_->queued_count(), 4U);
  fill();
  EXPECT_EQ(exchange_->take()->sequence, 2U);
}

TEST_F(FrameExchangeTest, ABufferThatTheCameraRefusesIsTriedAgain) {
  exchange_ = make_exchange(3);
  bool refuses = false;
  ASSERT_TRUE(exchange_->begin([&](std::size_t slot) {
    if (!refuses) {
      queued_.push_back(slot);
    }
    return !refuses;
  }));
  refuses = true;
  fill();
  frame().release();
  fill();
  EXPECT_EQ(exchange_->queued_count(), 1U);
  refuses = false;
  fill();
  EXPECT_EQ(exchange_->queued_count(), 1U) << "slot 0; 1 and 2 are filled";
}

TEST_F(FrameExchangeTest, DoesNotBeginWithACameraThatTakesNothing) {
  EXPECT_FALSE(make_exchange(3)->begin([](std::size_t) { return false; }));
}

TEST_F(FrameExchangeTest, TellsTheProgressOfControls) {
  begin(3);
  FilledSlot one = filled(0, 0);
  one.control_round = 7;
  one.controls[ControlId::kGain] = 1500;
  exchange_->on_filled(one);
  const FrameExchange::Progress progress = exchange_->progress();
  EXPECT_EQ(progress.filled_count, 1U);
  EXPECT_EQ(progress.control_round, 7U);
  EXPECT_EQ(progress.controls[ControlId::kGain], 1500);
}

/// A camera on one thread, a consumer on another, releases on a third: with the thread sanitizer.
TEST_F(FrameExchangeTest, WorksWithThreadsOnAllSides) {
  constexpr std::uint32_t kFrames = 2000;
  exchange_ = make_exchange(5);
  std::mutex mutex;
  std::deque<std::size_t> queued;
  WakeEvent has_buffer;
  ASSERT_TRUE(exchange_->begin([&](std::size_t slot) {
    const std::lock_guard lock(mutex);
    queued.push_back(slot);
    has_buffer.set();
    return true;
  }));
  const SteadyClock clock;
  std::jthread camera([&] {
    for (std::uint32_t sequence = 0; sequence < kFrames;) {
      std::optional<std::size_t> slot;
      has_buffer.clear();
      {
        const std::lock_guard lock(mutex);
        if (!queued.empty()) {
          slot = queued.front();
          queued.pop_front();
        }
      }
      if (slot) {
        exchange_->on_filled(filled(*slot, sequence++));
      } else {
        std::array<pollfd, 1> entry = {pollfd{has_buffer.fd(), POLLIN, 0}};
        (void)poll_until(entry, std::chrono::seconds(30), clock);
      }
    }
  });
  for (std::uint32_t sequence = 0; sequence < kFrames;) {
    exchange_->ready().clear();
    if (const std::optional<FilledSlot> taken = exchange_->take()) {
      ASSERT_EQ(taken->sequence, sequence++);
      Frame one(FrameInfo{}, exchange_->memory(taken->slot), exchange_, taken->slot);
      ASSERT_EQ(one.bytes()[0], taken->slot);
      if (sequence % 16 == 0) {
        std::jthread([held = std::move(one)]() mutable { held.release(); }).join();
      }
    } else {
      std::array<pollfd, 1> entry = {pollfd{exchange_->ready().fd(), POLLIN, 0}};
      ASSERT_EQ(poll_until(entry, std::chrono::seconds(30), clock), 1);
    }
  }
}

}  // namespace
}  // namespace trigmesh
