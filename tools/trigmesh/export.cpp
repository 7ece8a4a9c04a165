#include <CLI/CLI.hpp>

#include "tools/trigmesh/command.hpp"

namespace trigmesh {

void add_export_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("export", "");
  command->callback([&context] {
    finish_command(context, fail(ErrorCode::kUnsupported, "export is not built in yet"));
  });
}

}  // namespace trigmesh
