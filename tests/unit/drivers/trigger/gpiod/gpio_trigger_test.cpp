#include "drivers/trigger/gpiod/gpio_trigger.hpp"

#include <deque>
#include <map>
#include <string>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/manual_clock.hpp"

namespace trigmesh {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

constexpr GpioLevel kOn = GpioLevel::kActive;
constexpr GpioLevel kOff = GpioLevel::kInactive;

/// A line that is none; the kernel's queue of edges is `edges`.
struct FakeLine {
  WakeEvent readable;
  std::deque<GpioEdge> edges;
  GpioLevel level = kOff;
  bool is_gone = false;

  void move(std::chrono::nanoseconds time, GpioLevel to) {
    edges.push_back({time, to});
    level = to;
    readable.set();
  }
};

class FakeInput final : public GpioInput {
 public:
  explicit FakeInput(FakeLine& line) : line_(line) {}

  [[nodiscard]] int fd() const override { return line_.readable.fd(); }

  [[nodiscard]] DeviceResult<std::size_t> read(std::span<GpioEdge> edges) override {
    if (line_.is_gone) {
      return device_fault(FaultKind::kDisconnected, "gone");
    }
    std::size_t count = 0;
    for (; count < edges.size() && !line_.edges.empty(); ++count) {
      edges[count] = line_.edges.front();
      line_.edges.pop_front();
    }
    if (line_.edges.empty()) {
      line_.readable.clear();
    }
    return count;
  }

  [[nodiscard]] DeviceResult<GpioLevel> level() override { return line_.level; }

 private:
  FakeLine& line_;
};

class GpioTriggerTest : public ::testing::Test {
 protected:
  [[nodiscard]] std::unique_ptr<GpioTrigger> make() {
    GpioTriggerOptions options;
    options.buttons = {{0, {.chip = "panel", .line = "capture"}},
                       {1, {.chip = "panel", .line = "mode"}}};
    auto trigger = GpioTrigger::create(
        options,
        [this](const GpioSpec& spec) -> DeviceResult<std::unique_ptr<GpioInput>> {
          if (spec.line == missing_) {
            return device_fault(FaultKind::kNotFound, "there is no GPIO {}", spec.line);
          }
          return std::make_unique<FakeInput>(lines_[spec.line]);
        },
        clock_);
    EXPECT_TRUE(trigger) << trigger.error().message;
    return *std::move(trigger);
  }

  test_support::ManualClock clock_;
  std::map<std::string, FakeLine> lines_;
  std::string missing_;
};

TEST_F(GpioTriggerTest, TellsAPressWhenTheContactIsAtRest) {
  const auto trigger = make();
  ASSERT_TRUE(trigger->start());
  lines_["capture"].move(100s, kOn);
  lines_["capture"].move(100s + 2ms, kOff);
  lines_["capture"].move(100s + 3ms, kOn);
  EXPECT_TRUE(std::holds_alternative<NoTrigger>(trigger->wait(0s)));
  clock_.time = 100s + 13ms;
  EXPECT_EQ(std::get<TriggerEdge>(trigger->wait(0s)),
            (TriggerEdge{100s, 0, TriggerAction::kPressed}));
  lines_["capture"].move(101s, kOff);
  clock_.time = 102s;
  EXPECT_EQ(std::get<TriggerEdge>(trigger->wait(0s)).action, TriggerAction::kReleased);
  EXPECT_EQ(trigger->suppressed_count(), 2U);
}

TEST_F(GpioTriggerTest, OfTwoButtonsTheFirstToMoveComesFirst) {
  const auto trigger = make();
  ASSERT_TRUE(trigger->start());
  lines_["capture"].move(100s + 2ms, kOn);
  lines_["mode"].move(100s + 1ms, kOn);
  clock_.time = 101s;
  EXPECT_EQ(std::get<TriggerEdge>(trigger->wait(0s)).button, 1U);
  EXPECT_EQ(std::get<TriggerEdge>(trigger->wait(0s)).button, 0U);
}

TEST_F(GpioTriggerTest, ALostEdgeIsFoundByTheLevelOfTheLine) {
  const auto trigger = make();
  ASSERT_TRUE(trigger->start());
  FakeLine& line = lines_["capture"];
  line.move(100s, kOn);
  line.move(100s + 1ms, kOff);
  line.level = kOn;  // the kernel's queue was full: the last edge is not in it
  clock_.time = 100s + 11ms;
  EXPECT_TRUE(std::holds_alternative<NoTrigger>(trigger->wait(0s)));
  clock_.time = 100s + 21ms;
  EXPECT_EQ(std::get<TriggerEdge>(trigger->wait(0s)),
            (TriggerEdge{100s, 0, TriggerAction::kPressed}));
}

TEST_F(GpioTriggerTest, AButtonThatIsHeldAtTheStartIsNoPress) {
  const auto trigger = make();
  lines_["capture"].level = kOn;
  ASSERT_TRUE(trigger->start());
  clock_.time += 1s;
  EXPECT_TRUE(std::holds_alternative<NoTrigger>(trigger->wait(0s)));
  lines_["capture"].move(clock_.time, kOff);
  lines_["capture"].move(clock_.time + 100ms, kOn);
  clock_.time += 1s;
  const TriggerEvent first = trigger->wait(0s);
  EXPECT_EQ(std::get<TriggerEdge>(first).action, TriggerAction::kPressed);
}

TEST_F(GpioTriggerTest, ALineThatGoesEndsTheSource) {
  const auto trigger = make();
  ASSERT_TRUE(trigger->start());
  lines_["mode"].is_gone = true;
  lines_["mode"].readable.set();
  EXPECT_EQ(std::get<DeviceFault>(trigger->wait(0s)).kind, FaultKind::kDisconnected);
  EXPECT_EQ(std::get<DeviceFault>(trigger->wait(0s)).kind, FaultKind::kNotStarted);
  lines_["mode"].is_gone = false;
  EXPECT_TRUE(trigger->start());
}

TEST_F(GpioTriggerTest, StartsWithAllLinesOrNone) {
  const auto trigger = make();
  missing_ = "mode";
  EXPECT_EQ(trigger->start().error().kind, FaultKind::kNotFound);
  EXPECT_EQ(std::get<DeviceFault>(trigger->wait(0s)).kind, FaultKind::kNotStarted);
}

TEST_F(GpioTriggerTest, AStopRequestEndsTheWait) {
  const auto trigger = make();
  ASSERT_TRUE(trigger->start());
  trigger->request_stop();
  EXPECT_TRUE(std::holds_alternative<WaitStopped>(trigger->wait(1h)));
}

TEST(GpioTriggerOptions, NamesWhatIsWrong) {
  GpioTriggerOptions options;
  EXPECT_FALSE(options.validate());
  options.buttons = {{3, {}}, {3, {}}};
  EXPECT_THAT(options.validate().error().message, HasSubstr("2 buttons with 1 numbers"));
  options.buttons.pop_back();
  EXPECT_TRUE(options.validate());
  options.settle = 101ms;
  EXPECT_THAT(options.validate().error().message, HasSubstr("settle is 101 ms"));
}

}  // namespace
}  // namespace trigmesh
