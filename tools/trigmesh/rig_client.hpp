#pragma once

#include <cstdint>
#include <string>

#include "firmware/control/control_client.hpp"
#include "firmware/control/control_target.hpp"

namespace CLI {
class App;
}

namespace trigmesh {

/// What all subcommands that talk to the service have.
struct RigArguments {
  std::string socket = "/run/trigmesh/control.sock";
  bool json = false;

  [[nodiscard]] ControlClient client() const { return ControlClient({.socket_path = socket}); }
};

/// Adds --socket. `arguments` outlives the parsing.
void add_socket_option(CLI::App& command, RigArguments& arguments);
/// Adds --socket and --json.
void add_rig_options(CLI::App& command, RigArguments& arguments);

[[nodiscard]] Result<ControlStatus> ask_status(const ControlClient& client);

/// "12.3 MB", in powers of 1000.
[[nodiscard]] std::string size_text(std::uint64_t bytes);

/// Nothing is captured, and no model is made or waits.
[[nodiscard]] bool is_idle(const ControlStatus& status);

}  // namespace trigmesh
