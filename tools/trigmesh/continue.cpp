// trigmesh continue: more frames for a session that was closed.

#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "tools/trigmesh/command.hpp"
#include "tools/trigmesh/rig_client.hpp"

namespace trigmesh {
namespace {

constexpr const char* kFooter =
    R"(Opens a closed session again: in video mode frames are taken at once, in still mode with each press. When it is finished
its model is made anew, of all its frames; until then the earlier model stays. A session whose model is being made or waits
for it cannot be continued: wait, or `trigmesh trigger cancel`.

Examples:
  trigmesh continue 20261125T145054Z-3fa9c1
  trigmesh continue 20261125T145054Z-3fa9c1 && trigmesh trigger still && trigmesh trigger finish
)";

struct ContinueArguments {
  RigArguments rig;
  std::string id;
};

}  // namespace

void add_continue_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("continue", "Rig: take more frames for a closed session");
  const auto arguments = std::make_shared<ContinueArguments>();  // shared by the callback's copies
  command->add_option("SESSION", arguments->id, "Its id, as trigmesh sessions lists it")
      ->required();
  add_socket_option(*command, arguments->rig);
  command->footer(kFooter);
  command->callback([arguments, &context] {
    const auto answer = arguments->rig.client().post("/v1/sessions/" + arguments->id + "/continue");
    finish_command(context, answer.map([](const std::string& /*nothing*/) {}));
  });
}

}  // namespace trigmesh
