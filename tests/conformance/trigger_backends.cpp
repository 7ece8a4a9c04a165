#include <cstdlib>
#include <fstream>
#include <sstream>
#include <utility>

#include <gtest/gtest.h>

#include "drivers/trigger/command/command_trigger.hpp"
#include "drivers/trigger/gpiod/gpio_trigger.hpp"
#include "drivers/trigger/scripted/scripted_trigger.hpp"
#include "tests/conformance/trigger_backend.hpp"

namespace trigmesh::conformance {
namespace {

const SteadyClock kClock;

TriggerUnderTest make_command() {
  auto source = CommandTrigger::create(kClock);
  EXPECT_TRUE(source) << source.error().message;
  CommandTrigger* trigger = source->get();
  return {*std::move(source), [trigger](TriggerAction action) {
            const Result<> moved = trigger->inject(0, action);
            EXPECT_TRUE(moved) << moved.error().message;
          }};
}

/// More edges than any test takes, each let go by a move of the hand.
TriggerUnderTest make_scripted() {
  std::vector<TriggerEdge> edges;
  for (int i = 1; i <= 1000; ++i) {
    edges.push_back({std::chrono::seconds(i),
                     0,
                     i % 2 != 0 ? TriggerAction::kPressed : TriggerAction::kReleased});
  }
  auto source = ScriptedTrigger::create(std::move(edges), {.pace = ScriptPace::kLockStep}, kClock);
  EXPECT_TRUE(source) << source.error().message;
  ScriptedTrigger* trigger = source->get();
  return {*std::move(source), [trigger, moves = 0](TriggerAction) mutable {
            trigger->release_until(std::chrono::seconds(++moves));
          }};
}

void add_gpiod(TriggerBackends& backends) {
  const char* setting = std::getenv("TRIGMESH_TEST_GPIO");
  if (setting == nullptr) {
    backends.skipped.emplace_back("gpiod: TRIGMESH_TEST_GPIO names no simulated line");
    return;
  }
  std::istringstream parts(setting);
  GpioSpec spec{.chip = {}, .line = {}, .bias = GpioBias::kPullUp, .active = GpioActive::kLow};
  std::string pull;
  std::getline(std::getline(std::getline(parts, spec.chip, ','), spec.line, ','), pull);
  const auto make = [spec, pull]() -> TriggerUnderTest {
    auto source = GpioTrigger::create({.buttons = {{0, spec}}}, open_gpio_input, kClock);
    EXPECT_TRUE(source) << source.error().message;
    std::ofstream(pull) << "pull-up";
    return {*std::move(source), [pull](TriggerAction action) {
              std::ofstream file(pull);
              file << (action == TriggerAction::kPressed ? "pull-down" : "pull-up");
              file.close();
              EXPECT_TRUE(file.good()) << "cannot write " << pull;
            }};
  };
  backends.running.push_back({.name = "gpiod", .make = make});
}

TriggerBackends find_backends() {
  TriggerBackends backends;
  backends.running.push_back({.name = "command", .make = make_command});
  backends.running.push_back({.name = "scripted", .make = make_scripted});
  add_gpiod(backends);
  return backends;
}

}  // namespace

const TriggerBackends& trigger_backends() {
  static const TriggerBackends backends = find_backends();
  return backends;
}

}  // namespace trigmesh::conformance
