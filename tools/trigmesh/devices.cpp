// trigmesh devices: what is plugged in.

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/control/control_json.hpp"
#include "firmware/control/control_parse.hpp"
#include "firmware/devices/device_list.hpp"
#include "tools/trigmesh/command.hpp"
#include "tools/trigmesh/rig_client.hpp"

namespace trigmesh {
namespace {

constexpr const char* kFooter =
    R"(NAME is what the settings want as camera.device, trigger.chip and indicator.chip. Without a service that answers, the
board is asked directly.

Examples:
  trigmesh devices
  trigmesh devices --json | jq -r '.[] | select(.kind == "camera") | .name'
)";

/// The answer of the service, or of the board.
Result<std::string> ask(const RigArguments& arguments) {
  const ControlClient client = arguments.client();
  if (const Result<> connected = client.check_connection(); !connected) {
    fmt::print(stderr, "no service answers at {}; asking the board\n", arguments.socket);
    return render_devices(find_devices());
  }
  return client.get("/v1/devices");
}

void print(const std::vector<DeviceInfo>& devices) {
  if (devices.empty()) {
    fmt::print("no cameras and no GPIO chips\n");
  }
  for (const DeviceInfo& device : devices) {
    fmt::print("{}  {}\n", device.kind, device.stable_name);
    if (!device.model.empty()) {
      fmt::print("    {}\n", device.model);
    }
    if (!device.note.empty()) {
      fmt::print("    {}\n", device.note);
    }
  }
}

Result<> run(const RigArguments& arguments) {
  TM_ASSIGN_OR_RETURN(const std::string answer, ask(arguments));
  if (arguments.json) {
    fmt::print("{}\n", answer);
    return {};
  }
  return parse_devices(answer).map(print);
}

}  // namespace

void add_devices_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("devices", "Rig: list cameras and GPIO chips");
  const auto arguments = std::make_shared<RigArguments>();  // shared by the callback's copies
  add_rig_options(*command, *arguments);
  command->footer(kFooter);
  command->callback([arguments, &context] { finish_command(context, run(*arguments)); });
}

}  // namespace trigmesh
