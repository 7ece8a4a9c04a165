#include <chrono>
#include <iostream>
#include <optional>
#include <thread>

#include <gtest/gtest.h>

#include "drivers/trigger/trigger_source.hpp"
#include "tests/conformance/trigger_backend.hpp"

namespace trigmesh::conformance {
namespace {

using namespace std::chrono_literals;

/// Only a broken source needs all of it.
constexpr std::chrono::nanoseconds kPatience = 20s;

class TriggerConformance : public ::testing::TestWithParam<TriggerBackend> {
 protected:
  void expect_edge(TriggerAction action) {
    trigger_.move(action);
    const TriggerEvent event = trigger_.source->wait(kPatience);
    const auto* edge = std::get_if<TriggerEdge>(&event);
    ASSERT_NE(edge, nullptr);
    EXPECT_EQ(edge->action, action);
    EXPECT_EQ(edge->button, 0U);
    EXPECT_TRUE(!last_time_ || *last_time_ < edge->timestamp);
    last_time_ = edge->timestamp;
  }

  [[nodiscard]] bool says_not_started() {
    const TriggerEvent event = trigger_.source->wait(kPatience);
    const auto* fault = std::get_if<DeviceFault>(&event);
    return fault != nullptr && fault->kind == FaultKind::kNotStarted;
  }

  TriggerUnderTest trigger_ = GetParam().make();
  std::optional<std::chrono::nanoseconds> last_time_;
};

TEST_P(TriggerConformance, TellsEachPressAndReleaseOnceInOrder) {
  ASSERT_TRUE(trigger_.source->start());
  for (int i = 0; i < 25; ++i) {
    expect_edge(TriggerAction::kPressed);
    expect_edge(TriggerAction::kReleased);
  }
  EXPECT_TRUE(std::holds_alternative<NoTrigger>(trigger_.source->wait(0ns)));
}

TEST_P(TriggerConformance, SaysThatItIsNotStarted) {
  EXPECT_TRUE(says_not_started());
  ASSERT_TRUE(trigger_.source->start());
  trigger_.source->stop();
  EXPECT_TRUE(says_not_started());
}

TEST_P(TriggerConformance, StartsAndStopsAgainAndAgain) {
  trigger_.source->stop();
  for (int round = 0; round < 3; ++round) {
    ASSERT_TRUE(trigger_.source->start());
    ASSERT_TRUE(trigger_.source->start()) << "twice is once";
    trigger_.source->stop();
    trigger_.source->stop();
  }
  ASSERT_TRUE(trigger_.source->start());
  expect_edge(TriggerAction::kPressed);
  expect_edge(TriggerAction::kReleased);
}

TEST_P(TriggerConformance, HonoursTheTimeout) {
  ASSERT_TRUE(trigger_.source->start());
  EXPECT_TRUE(std::holds_alternative<NoTrigger>(trigger_.source->wait(0ns)));
  EXPECT_TRUE(std::holds_alternative<NoTrigger>(trigger_.source->wait(-1ns)));
  EXPECT_TRUE(std::holds_alternative<NoTrigger>(trigger_.source->wait(3ms)));
}

TEST_P(TriggerConformance, AStopRequestEndsABlockedWaitUntilStop) {
  ASSERT_TRUE(trigger_.source->start());
  std::jthread asker([this] { trigger_.source->request_stop(); });
  // Without the request this would wait for ever: the time-out of the test is the assertion.
  EXPECT_TRUE(
      std::holds_alternative<WaitStopped>(trigger_.source->wait(std::chrono::nanoseconds::max())));
  EXPECT_TRUE(std::holds_alternative<WaitStopped>(trigger_.source->wait(0ns)));
  asker.join();
  trigger_.source->stop();
  ASSERT_TRUE(trigger_.source->start());
  expect_edge(TriggerAction::kPressed);
  expect_edge(TriggerAction::kReleased);
}

TEST_P(TriggerConformance, AStopRequestBeforeTheStartIsNotLost) {
  trigger_.source->request_stop();
  ASSERT_TRUE(trigger_.source->start());
  EXPECT_TRUE(std::holds_alternative<WaitStopped>(trigger_.source->wait(kPatience)));
}

INSTANTIATE_TEST_SUITE_P(Backends,
                         TriggerConformance,
                         ::testing::ValuesIn(trigger_backends().running),
                         [](const auto& test) { return test.param.name; });

TEST(TriggerBackends, SaysWhichWereSkipped) {
  const TriggerBackends& backends = trigger_backends();
  std::cout << backends.running.size() << " trigger backends tested, " << backends.skipped.size()
            << " skipped\n";
  for (const std::string& reason : backends.skipped) {
    std::cout << "skipped: " << reason << '\n';
  }
  EXPECT_GE(backends.running.size(), 2U);
}

}  // namespace
}  // namespace trigmesh::conformance
