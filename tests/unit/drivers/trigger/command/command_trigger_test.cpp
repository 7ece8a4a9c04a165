#include "drivers/trigger/command/command_trigger.hpp"

#include <thread>

#include <gtest/gtest.h>

#include "tests/support/manual_clock.hpp"

namespace trigmesh {
namespace {

using namespace std::chrono_literals;

constexpr TriggerAction kDown = TriggerAction::kPressed;
constexpr TriggerAction kUp = TriggerAction::kReleased;

class CommandTriggerTest : public ::testing::Test {
 protected:
  CommandTriggerTest() {
    auto trigger = CommandTrigger::create(clock_);
    EXPECT_TRUE(trigger);
    trigger_ = *std::move(trigger);
    EXPECT_TRUE(trigger_->start());
  }

  test_support::ManualClock clock_;
  std::unique_ptr<CommandTrigger> trigger_;
};

TEST_F(CommandTriggerTest, DeliversInOrderWithTheTimeOfTheCommand) {
  EXPECT_TRUE(std::holds_alternative<NoTrigger>(trigger_->wait(0s)));
  ASSERT_TRUE(trigger_->inject(2, kDown));
  clock_.time += 3s;
  ASSERT_TRUE(trigger_->inject(2, kUp));
  EXPECT_EQ(std::get<TriggerEdge>(trigger_->wait(0s)), (TriggerEdge{100s, 2, kDown}));
  EXPECT_EQ(std::get<TriggerEdge>(trigger_->wait(0s)), (TriggerEdge{103s, 2, kUp}));
  EXPECT_TRUE(std::holds_alternative<NoTrigger>(trigger_->wait(0s)));
}

TEST_F(CommandTriggerTest, AButtonIsPressedAndReleasedInTurn) {
  EXPECT_EQ(trigger_->inject(0, kUp).error().code, ErrorCode::kInvalidArgument);
  ASSERT_TRUE(trigger_->inject(0, kDown));
  EXPECT_EQ(trigger_->inject(0, kDown).error().code, ErrorCode::kInvalidArgument);
  EXPECT_TRUE(trigger_->inject(1, kDown)) << "another button";
  trigger_->stop();
  ASSERT_TRUE(trigger_->start());
  EXPECT_TRUE(trigger_->inject(0, kDown)) << "stop releases all";
}

TEST_F(CommandTriggerTest, HoldsItsLimit) {
  for (std::size_t i = 0; i < CommandTrigger::kMostWaiting; ++i) {
    ASSERT_TRUE(trigger_->inject(0, i % 2 == 0 ? kDown : kUp));
  }
  EXPECT_EQ(trigger_->inject(0, kDown).error().code, ErrorCode::kLimitExceeded);
  EXPECT_TRUE(std::holds_alternative<TriggerEdge>(trigger_->wait(0s)));
  EXPECT_TRUE(trigger_->inject(0, kDown));
}

TEST_F(CommandTriggerTest, WakesABlockedWait) {
  std::jthread other([this] { EXPECT_TRUE(trigger_->inject(0, kDown)); });
  EXPECT_TRUE(std::holds_alternative<TriggerEdge>(trigger_->wait(1h)));
  std::jthread stopper([this] { trigger_->request_stop(); });
  EXPECT_TRUE(std::holds_alternative<WaitStopped>(trigger_->wait(1h)));
}

TEST_F(CommandTriggerTest, LosesNothingOfSeveralThreads) {
  constexpr int kPresses = 60;
  std::vector<std::jthread> threads;
  for (std::uint32_t button = 0; button < 2; ++button) {
    threads.emplace_back([this, button] {
      for (int i = 0; i < kPresses; ++i) {
        EXPECT_TRUE(trigger_->inject(button, i % 2 == 0 ? kDown : kUp));
      }
    });
  }
  for (int i = 0; i < 2 * kPresses; ++i) {
    ASSERT_TRUE(std::holds_alternative<TriggerEdge>(trigger_->wait(1h))) << i;
  }
  EXPECT_TRUE(std::holds_alternative<NoTrigger>(trigger_->wait(0s)));
}

}  // namespace
}  // namespace trigmesh
