#pragma once

#include "firmware/base/result.hpp"

namespace CLI {
class App;
}

namespace trigmesh {

/// What a subcommand hands back to main.
struct CommandContext {
  int exit_code = 0;
};

/// The exit code that tells a script what kind of failure it was; tools/trigmesh/README.md has the
/// table.
[[nodiscard]] int exit_code(ErrorCode code);

/// Ends a subcommand: prints the error, if there is one, once as `trigmesh: MESSAGE` on stderr and
/// sets the exit code.
void finish_command(CommandContext& context, const Result<>& result);

// A subcommand is one .cpp with one of these functions: it adds `app.add_subcommand(...)` with its
// options and a callback that does the work and ends with finish_command. To add one, declare it
// here and name it in add_all_commands (main.cpp). `context` outlives the parsing.

void add_reconstruct_command(CLI::App& app, CommandContext& context);
void add_continue_command(CLI::App& app, CommandContext& context);
void add_replay_command(CLI::App& app, CommandContext& context);
/// densify, mesh and texture.
void add_surface_commands(CLI::App& app, CommandContext& context);
void add_calibrate_command(CLI::App& app, CommandContext& context);
void add_export_command(CLI::App& app, CommandContext& context);
void add_evaluate_command(CLI::App& app, CommandContext& context);

// These talk to the service of the rig.
void add_status_command(CLI::App& app, CommandContext& context);
void add_trigger_command(CLI::App& app, CommandContext& context);
void add_record_command(CLI::App& app, CommandContext& context);
void add_watch_command(CLI::App& app, CommandContext& context);
void add_sessions_command(CLI::App& app, CommandContext& context);
void add_devices_command(CLI::App& app, CommandContext& context);

}  // namespace trigmesh
