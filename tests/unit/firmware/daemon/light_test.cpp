#include "firmware/daemon/light.hpp"

#include <chrono>
#include <memory>
#include <optional>
#include <thread>

#include <gtest/gtest.h>

#include "firmware/base/bounded_queue.hpp"

namespace trigmesh {
namespace {

RigState well() {
  RigState state;
  state.camera_present = true;
  return state;
}

TEST(LightPattern, AFaultComesFirst) {
  RigState state = well();
  state.session_open = true;
  state.camera_present = false;
  EXPECT_EQ(pattern_of(state, LastOutcome::kNone), IndicatorPattern::kFailed);
  state = well();
  state.storage = StorageLevel::kFull;
  EXPECT_EQ(pattern_of(state, LastOutcome::kDone), IndicatorPattern::kFailed);
}

TEST(LightPattern, ThenWhatTheRigDoes) {
  RigState state = well();
  EXPECT_EQ(pattern_of(state, LastOutcome::kNone), IndicatorPattern::kIdle);
  state.job = JobState::kRunning;
  EXPECT_EQ(pattern_of(state, LastOutcome::kFailed), IndicatorPattern::kWorking);
  state.session_open = true;
  EXPECT_EQ(pattern_of(state, LastOutcome::kNone), IndicatorPattern::kCapturing);
  state.storage = StorageLevel::kLow;
  EXPECT_EQ(pattern_of(state, LastOutcome::kNone), IndicatorPattern::kStorageLow);
}

TEST(LightPattern, ThenHowTheLastModelEnded) {
  EXPECT_EQ(pattern_of(well(), LastOutcome::kDone), IndicatorPattern::kDone);
  EXPECT_EQ(pattern_of(well(), LastOutcome::kFailed), IndicatorPattern::kFailed);
}

/// Tells the thread that waits what was shown.
class TellingIndicator final : public Indicator {
 public:
  explicit TellingIndicator(BoundedQueue<IndicatorLevels>& shown) : shown_(shown) {}

  DeviceResult<> show(const IndicatorLevels& levels) override {
    (void)shown_.push(levels);
    return {};
  }

 private:
  BoundedQueue<IndicatorLevels>& shown_;
};

TEST(Light, PlaysThePatternAndIsDarkAtTheEnd) {
  const SteadyClock clock;
  Faults faults(clock, std::chrono::seconds(60));
  Heartbeat heartbeat("light", clock);
  BoundedQueue<IndicatorLevels> shown(100, OverflowPolicy::kDropOldest);
  Light light(
      [&shown]() -> DeviceResult<std::unique_ptr<Indicator>> {
        return std::make_unique<TellingIndicator>(shown);
      },
      faults,
      heartbeat,
      clock);
  light.set(IndicatorPattern::kWorking);
  std::jthread thread([&light](const std::stop_token& stop) { light.run(stop); });
  bool was_on = false;
  bool was_off_again = false;
  while (!was_off_again) {  // slow, even blinking
    const auto levels = shown.pop({}, std::chrono::seconds(30));
    ASSERT_TRUE(levels);
    was_off_again = was_on && !levels->light;
    was_on = was_on || levels->light;
  }
  light.set(IndicatorPattern::kCapturing);
  while (!shown.pop({}, std::chrono::seconds(30))->light) {
  }
  thread.request_stop();
  thread.join();
  std::optional<IndicatorLevels> last;
  while (const auto levels = shown.try_pop()) {
    last = levels;
  }
  ASSERT_TRUE(last);
  EXPECT_EQ(*last, IndicatorLevels{});
}

TEST(Light, ALightThatCannotBeOpenedIsAFaultAndTriedAgain) {
  const SteadyClock clock;
  Faults faults(clock, std::chrono::seconds(60));
  Heartbeat heartbeat("light", clock);
  BoundedQueue<IndicatorLevels> shown(100, OverflowPolicy::kDropOldest);
  int tries = 0;
  Light light(
      [&]() -> DeviceResult<std::unique_ptr<Indicator>> {
        if (++tries == 1) {
          return device_fault(FaultKind::kBusy, "another program has it");
        }
        return std::make_unique<TellingIndicator>(shown);
      },
      faults,
      heartbeat,
      clock);
  light.set(IndicatorPattern::kCapturing);
  std::jthread thread([&light](const std::stop_token& stop) { light.run(stop); });
  EXPECT_TRUE(shown.pop({}, std::chrono::seconds(30)));
}

}  // namespace
}  // namespace trigmesh
