#include "tools/trigmesh/rig_client.hpp"

#include <array>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/control/control_parse.hpp"

namespace trigmesh {

void add_socket_option(CLI::App& command, RigArguments& arguments) {
  command.add_option("--socket", arguments.socket, "Control socket of the service")
      ->capture_default_str()
      ->option_text("PATH");
}

void add_rig_options(CLI::App& command, RigArguments& arguments) {
  add_socket_option(command, arguments);
  command.add_flag("--json", arguments.json, "Answer of the service as JSON, for scripts");
}

Result<ControlStatus> ask_status(const ControlClient& client) {
  return client.get("/v1/status").and_then(parse_status);
}

std::string size_text(std::uint64_t bytes) {
  constexpr double kStep = 1000.0;
  constexpr std::array kUnits{"kB", "MB", "GB", "TB"};
  if (bytes < 1000) {
    return fmt::format("{} B", bytes);
  }
  double size = static_cast<double>(bytes) / kStep;
  std::size_t unit = 0;
  while (size >= kStep && unit + 1 < kUnits.size()) {
    size /= kStep;
    ++unit;
  }
  return fmt::format("{:.1f} {}", size, kUnits[unit]);
}

bool is_idle(const ControlStatus& status) {
  return status.phase == RigPhase::kIdle && status.session_id.empty() &&
         status.job == JobState::kNone && status.queued_models == 0;
}

}  // namespace trigmesh
