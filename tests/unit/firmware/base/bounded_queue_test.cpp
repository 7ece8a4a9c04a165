#include "firmware/base/bounded_queue.hpp"

#include <chrono>
#include <memory>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace trigmesh {
namespace {

using std::chrono::nanoseconds;
using std::chrono::seconds;

TEST(BoundedQueue, GivesItemsInTheirOrder) {
  BoundedQueue<int> queue(3, OverflowPolicy::kBlock);
  for (int round = 0; round < 5; ++round) {  // round the ring
    EXPECT_EQ(queue.push(1), PushOutcome::kPushed);
    EXPECT_EQ(queue.push(2), PushOutcome::kPushed);
    EXPECT_EQ(queue.try_pop(), 1);
    EXPECT_EQ(queue.pop({}, nanoseconds(0)), 2);
  }
  EXPECT_FALSE(queue.try_pop());
}

TEST(BoundedQueue, DropsTheOldestAtItsLimitAndCounts) {
  BoundedQueue<std::unique_ptr<int>> queue(2, OverflowPolicy::kDropOldest);
  EXPECT_EQ(queue.push(std::make_unique<int>(1)), PushOutcome::kPushed);
  EXPECT_EQ(queue.push(std::make_unique<int>(2)), PushOutcome::kPushed);
  EXPECT_EQ(queue.push(std::make_unique<int>(3)), PushOutcome::kPushedDroppingOldest);
  EXPECT_EQ(queue.size(), 2U);
  EXPECT_EQ(**queue.try_pop(), 2);
  EXPECT_EQ(**queue.try_pop(), 3);
  EXPECT_EQ(queue.counters().pushed, 3U);
  EXPECT_EQ(queue.counters().dropped, 1U);
  EXPECT_EQ(queue.counters().most_waiting, 2U);
}

TEST(BoundedQueue, BlocksAtItsLimitUntilThereIsRoom) {
  BoundedQueue<int> queue(1, OverflowPolicy::kBlock);
  (void)queue.push(0);
  std::jthread producer([&] {
    for (int i = 1; i <= 100; ++i) {
      (void)queue.push(i);
    }
  });
  for (int i = 0; i <= 100; ++i) {
    ASSERT_EQ(queue.pop({}, seconds(30)), i);
  }
  EXPECT_EQ(queue.counters().most_waiting, 1U);
}

TEST(BoundedQueue, AStopEndsWaitingOnBothSides) {
  BoundedQueue<int> queue(1, OverflowPolicy::kBlock);
  (void)queue.push(0);
  PushOutcome outcome = PushOutcome::kPushed;
  {
    std::jthread producer([&](const std::stop_token& stop) { outcome = queue.push(1, stop); });
    producer.request_stop();
  }
  EXPECT_EQ(outcome, PushOutcome::kStopped);
  (void)queue.try_pop();
  std::jthread consumer(
      [&](const std::stop_token& stop) { EXPECT_FALSE(queue.pop(stop, seconds(30))); });
  consumer.request_stop();
}

TEST(BoundedQueue, WaitsNoLongerThanTold) {
  BoundedQueue<int> queue(1, OverflowPolicy::kBlock);
  EXPECT_FALSE(queue.pop({}, std::chrono::milliseconds(1)));
}

}  // namespace
}  // namespace trigmesh
