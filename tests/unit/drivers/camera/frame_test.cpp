#include "drivers/camera/frame.hpp"

#include <memory>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/camera/slot_pool.hpp"

namespace trigmesh {
namespace {

using ::testing::ElementsAre;

/// Writes down what comes back.
class ListingPool final : public FramePool {
 public:
  explicit ListingPool(std::vector<std::size_t>& returned) : returned_(returned) {}

  void give_back(std::size_t slot) noexcept override { returned_.push_back(slot); }

 private:
  std::vector<std::size_t>& returned_;
};

class FrameTest : public ::testing::Test {
 protected:
  [[nodiscard]] Frame frame(std::size_t slot) const {
    FrameInfo info;
    info.sequence = slot;
    return Frame(info, bytes_, pool_, slot);
  }

  std::vector<std::size_t> returned_;
  const std::vector<std::uint8_t> bytes_ = {1, 2, 3};
  std::shared_ptr<ListingPool> pool_ = std::make_shared<ListingPool>(returned_);
};

TEST_F(FrameTest, GivesItsBufferBackOnceWhenItGoes) {
  {
    const Frame a = frame(5);
    EXPECT_FALSE(a.empty());
    EXPECT_EQ(a.bytes().size(), 3U);
    EXPECT_TRUE(returned_.empty());
  }
  EXPECT_THAT(returned_, ElementsAre(5));
}

TEST_F(FrameTest, MovingGivesNothingBack) {
  Frame a = frame(1);
  Frame b = std::move(a);
  EXPECT_TRUE(a.empty());  // NOLINT(bugprone-use-after-move): that is what is tested
  EXPECT_TRUE(a.bytes().empty());
  EXPECT_EQ(b.info().sequence, 1U);
  EXPECT_TRUE(returned_.empty());
}

TEST_F(FrameTest, MovingOverAFrameReleasesIt) {
  Frame a = frame(1);
  a = frame(2);
  EXPECT_THAT(returned_, ElementsAre(1));
  EXPECT_EQ(a.info().sequence, 2U);
  Frame& same = a;
  a = std::move(same);
  EXPECT_EQ(a.info().sequence, 2U);
  EXPECT_THAT(returned_, ElementsAre(1));
}

TEST_F(FrameTest, ReleasingTwiceReturnsOnce) {
  Frame a = frame(7);
  a.release();
  a.release();
  EXPECT_TRUE(a.empty());
  EXPECT_THAT(returned_, ElementsAre(7));
}

TEST_F(FrameTest, KeepsItsPool) {
  const std::weak_ptr<ListingPool> watch = pool_;
  Frame a = frame(0);
  pool_.reset();
  EXPECT_FALSE(watch.expired());
  a.release();
  EXPECT_TRUE(watch.expired());
}

TEST(SlotPool, HandsOutEachSlotOnceAndKeepsItsMemory) {
  SlotPool pool(2, nullptr);
  const auto a = pool.take();
  const auto b = pool.take();
  ASSERT_TRUE(a && b);
  EXPECT_NE(*a, *b);
  EXPECT_FALSE(pool.take());
  EXPECT_EQ(pool.out_count(), 2U);
  pool.bytes(*a).assign(1000, 7);
  const std::uint8_t* memory = pool.bytes(*a).data();
  EXPECT_FALSE(pool.returned().is_set());
  pool.give_back(*a);
  EXPECT_TRUE(pool.returned().is_set());
  EXPECT_EQ(pool.take(), a);
  EXPECT_EQ(pool.bytes(*a).data(), memory);
}

}  // namespace
}  // namespace trigmesh
