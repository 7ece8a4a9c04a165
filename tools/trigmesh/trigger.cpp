// trigmesh trigger: what the buttons do, from a terminal.

#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "tools/trigmesh/command.hpp"
#include "tools/trigmesh/rig_client.hpp"

namespace trigmesh {
namespace {

constexpr const char* kFooter = R"(WHAT is
  start   begin a session, and in video mode the stream
  still   keep one frame now
  undo    discard the frame that was kept last
  finish  close the session; its model is made next
  cancel  end the making of the model

Examples:
  trigmesh trigger start
  trigmesh trigger still && trigmesh trigger finish
)";

struct TriggerArguments {
  RigArguments rig;
  std::string what;
};

}  // namespace

void add_trigger_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("trigger", "Rig: do what a press of the button does");
  const auto arguments = std::make_shared<TriggerArguments>();  // shared by the callback's copies
  command->add_option("WHAT", arguments->what, "start, still, undo, finish or cancel")
      ->required()
      ->check(CLI::IsMember({"start", "still", "undo", "finish", "cancel"}));
  add_socket_option(*command, arguments->rig);
  command->footer(kFooter);
  command->callback([arguments, &context] {
    const auto answer = arguments->rig.client().post("/v1/" + arguments->what);
    finish_command(context, answer.map([](const std::string& /*nothing*/) {}));
  });
}

}  // namespace trigmesh
