#include "drivers/indicator/gpiod/gpio_indicator.hpp"

#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/indicator/mock/mock_indicator.hpp"

namespace trigmesh {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

const GpioSpec kLight{.chip = "panel", .line = "light"};
const GpioSpec kBuzzer{.chip = "panel", .line = "buzzer"};

/// Writes down what is switched, as "light on".
class FakeOutput final : public GpioOutput {
 public:
  FakeOutput(std::string name, std::vector<std::string>& log, const bool& fails)
      : name_(std::move(name)), log_(log), fails_(fails) {}

  [[nodiscard]] DeviceResult<> set(GpioLevel level) override {
    if (fails_) {
      return device_fault(FaultKind::kDisconnected, "gone");
    }
    log_.push_back(name_ + (level == GpioLevel::kActive ? " on" : " off"));
    return {};
  }

 private:
  std::string name_;
  std::vector<std::string>& log_;
  const bool& fails_;
};

class GpioIndicatorTest : public ::testing::Test {
 protected:
  [[nodiscard]] std::unique_ptr<GpioIndicator> make(const GpioIndicatorOptions& options) {
    auto indicator = GpioIndicator::create(
        options, [this](const GpioSpec& spec) -> DeviceResult<std::unique_ptr<GpioOutput>> {
          return std::make_unique<FakeOutput>(spec.line, log_, fails_);
        });
    EXPECT_TRUE(indicator);
    return *std::move(indicator);
  }

  [[nodiscard]] std::vector<std::string> taken() { return std::exchange(log_, {}); }

  std::vector<std::string> log_;
  bool fails_ = false;
};

TEST_F(GpioIndicatorTest, SwitchesWhatChanges) {
  auto indicator = make({.light = kLight, .buzzer = kBuzzer});
  EXPECT_TRUE(indicator->show({}));
  EXPECT_THAT(taken(), IsEmpty());
  EXPECT_TRUE(indicator->show({.light = true, .buzzer = true}));
  EXPECT_THAT(taken(), ElementsAre("light on", "buzzer on"));
  EXPECT_TRUE(indicator->show({.light = true, .buzzer = false}));
  EXPECT_THAT(taken(), ElementsAre("buzzer off"));
  indicator.reset();
  EXPECT_THAT(taken(), ElementsAre("light off"));
}

TEST_F(GpioIndicatorTest, IsSilentWithoutABuzzer) {
  auto indicator = make({.light = kLight, .buzzer = {}});
  EXPECT_TRUE(indicator->show({.light = false, .buzzer = true}));
  EXPECT_THAT(taken(), IsEmpty());
}

TEST_F(GpioIndicatorTest, AfterAFaultItSwitchesEverything) {
  auto indicator = make({.light = kLight, .buzzer = kBuzzer});
  fails_ = true;
  EXPECT_FALSE(indicator->show({.light = true, .buzzer = false}));
  fails_ = false;
  EXPECT_TRUE(indicator->show({.light = true, .buzzer = false}));
  EXPECT_THAT(taken(), ElementsAre("light on", "buzzer off"));
}

TEST(MockIndicator, ListsWhatItWasShown) {
  MockIndicator indicator;
  EXPECT_TRUE(indicator.show({.light = true, .buzzer = false}));
  indicator.fault = FaultKind::kIo;
  EXPECT_EQ(indicator.show({}).error().kind, FaultKind::kIo);
  EXPECT_EQ(indicator.shown.size(), 1U);
}

}  // namespace
}  // namespace trigmesh
