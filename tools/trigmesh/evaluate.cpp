#include <CLI/CLI.hpp>

#include "tools/trigmesh/command.hpp"

namespace trigmesh {

void add_evaluate_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("evaluate", "");
  command->callback([&context] {
    finish_command(context, fail(ErrorCode::kUnsupported, "evaluate is not built in yet"));
  });
}

}  // namespace trigmesh
