#include "drivers/trigger/scripted/scripted_trigger.hpp"

#include <thread>
#include <utility>

#include <gtest/gtest.h>

#include "tests/support/manual_clock.hpp"

namespace trigmesh {
namespace {

using namespace std::chrono_literals;

class ScriptedTriggerTest : public ::testing::Test {
 protected:
  [[nodiscard]] std::unique_ptr<ScriptedTrigger> make(const ScriptOptions& options) const {
    auto trigger = ScriptedTrigger::create(
        {{5s, 0, TriggerAction::kPressed}, {6s, 0, TriggerAction::kReleased}}, options, clock_);
    EXPECT_TRUE(trigger);
    EXPECT_TRUE((*trigger)->start());
    return *std::move(trigger);
  }

  test_support::ManualClock clock_;
};

TEST_F(ScriptedTriggerTest, PlaysAtOnceAndEnds) {
  const auto trigger = make({});
  EXPECT_EQ(std::get<TriggerEdge>(trigger->wait(0s)).timestamp, 5s);
  EXPECT_EQ(std::get<TriggerEdge>(trigger->wait(0s)).action, TriggerAction::kReleased);
  EXPECT_TRUE(std::holds_alternative<EndOfTriggers>(trigger->wait(0s)));
  trigger->stop();
  EXPECT_EQ(std::get<DeviceFault>(trigger->wait(0s)).kind, FaultKind::kNotStarted);
  ASSERT_TRUE(trigger->start());
  EXPECT_EQ(std::get<TriggerEdge>(trigger->wait(0s)).timestamp, 5s) << "from the beginning";
}

TEST_F(ScriptedTriggerTest, AtRecordedSpeedAnEdgeComesInItsTime) {
  const auto trigger = make({.pace = ScriptPace::kRecordedSpeed, .origin = 4s});
  EXPECT_TRUE(std::holds_alternative<NoTrigger>(trigger->wait(0s)));
  clock_.time += 1s;
  EXPECT_TRUE(std::holds_alternative<TriggerEdge>(trigger->wait(0s)));
  clock_.time += 1s - 1ns;
  EXPECT_TRUE(std::holds_alternative<NoTrigger>(trigger->wait(0s)));
  clock_.time += 1ns;
  EXPECT_TRUE(std::holds_alternative<TriggerEdge>(trigger->wait(0s)));
}

TEST_F(ScriptedTriggerTest, InLockStepAnEdgeComesWhenItsTimeIsReleased) {
  const auto trigger = make({.pace = ScriptPace::kLockStep});
  EXPECT_TRUE(std::holds_alternative<NoTrigger>(trigger->wait(0s)));
  trigger->release_until(5s);
  trigger->release_until(1s);  // never goes back
  EXPECT_TRUE(std::holds_alternative<TriggerEdge>(trigger->wait(0s)));
  EXPECT_TRUE(std::holds_alternative<NoTrigger>(trigger->wait(0s)));
  std::jthread other([&trigger] { trigger->release_until(6s); });
  // Blocks until the other thread has let it go: the time-out of the test is the assertion.
  EXPECT_TRUE(std::holds_alternative<TriggerEdge>(trigger->wait(1h)));
}

TEST_F(ScriptedTriggerTest, AStopRequestEndsTheWaitUntilStop) {
  const auto trigger = make({.pace = ScriptPace::kLockStep});
  std::jthread other([&trigger] { trigger->request_stop(); });
  EXPECT_TRUE(std::holds_alternative<WaitStopped>(trigger->wait(1h)));
  EXPECT_TRUE(std::holds_alternative<WaitStopped>(trigger->wait(1h)));
  trigger->stop();
  ASSERT_TRUE(trigger->start());
  EXPECT_TRUE(std::holds_alternative<NoTrigger>(trigger->wait(0s)));
}

}  // namespace
}  // namespace trigmesh
