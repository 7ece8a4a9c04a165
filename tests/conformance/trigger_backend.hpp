#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "drivers/trigger/trigger_source.hpp"

namespace trigmesh::conformance {

/// A trigger of one test, and the hand on its button 0.
struct TriggerUnderTest {
  std::unique_ptr<TriggerSource> source;
  std::function<void(TriggerAction)> move;
};

/// A backend as the suite sees it.
struct TriggerBackend {
  std::string name;
  std::function<TriggerUnderTest()> make;
};

/// Backends that run here: scripted and command always; gpiod when TRIGMESH_TEST_GPIO gives chip,
/// line and the pull file of a simulated line, separated by commas:
/// TRIGMESH_TEST_GPIO=rigpanel,btn-capture,/sys/devices/platform/gpio-sim.0/gpiochip0/sim_gpio3/pull
struct TriggerBackends {
  std::vector<TriggerBackend> running;
  std::vector<std::string> skipped;
};

[[nodiscard]] const TriggerBackends& trigger_backends();

}  // namespace trigmesh::conformance
