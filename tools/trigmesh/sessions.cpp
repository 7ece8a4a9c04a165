// trigmesh sessions: what is stored on the rig.

#include <memory>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/control/control_parse.hpp"
#include "tools/trigmesh/command.hpp"
#include "tools/trigmesh/rig_client.hpp"

namespace trigmesh {
namespace {

constexpr const char* kFooter = R"(Examples:
  trigmesh sessions
  trigmesh sessions --json | jq -r '.[] | select(.exported | not) | .id'
  trigmesh sessions remove 20261125T145054Z-3fa9c1
)";

struct SessionsArguments {
  RigArguments rig;
  std::string id;
};

std::string yes_or_no(bool truth) {
  return truth ? "yes" : "no";
}

void print(const std::vector<SessionInfo>& sessions) {
  if (sessions.empty()) {
    fmt::print("no sessions\n");
    return;
  }
  constexpr const char* kRow = "{:<24}  {:<14}  {:>6}  {:>9}  {:<5}  {}\n";
  fmt::print(fmt::runtime(kRow), "ID", "STATE", "FRAMES", "SIZE", "MODEL", "EXPORTED");
  for (const SessionInfo& session : sessions) {
    fmt::print(fmt::runtime(kRow),
               session.manifest.id,
               to_string(session.manifest.state),
               session.manifest.frame_count,
               size_text(session.size_bytes),
               yes_or_no(session.has_model),
               yes_or_no(session.manifest.exported));
  }
}

Result<> list(const RigArguments& rig) {
  TM_ASSIGN_OR_RETURN(const std::string answer, rig.client().get("/v1/sessions"));
  if (rig.json) {
    fmt::print("{}\n", answer);
    return {};
  }
  return parse_sessions(answer).map(print);
}

Result<> remove(const SessionsArguments& arguments) {
  TM_RETURN_IF_ERROR(arguments.rig.client().remove("/v1/sessions/" + arguments.id));
  fmt::print("removed {}\n", arguments.id);
  return {};
}

}  // namespace

void add_sessions_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("sessions", "Rig: list or remove sessions");
  const auto arguments = std::make_shared<SessionsArguments>();  // shared by the callbacks' copies
  add_rig_options(*command, arguments->rig);
  command->require_subcommand(0, 1);
  CLI::App* removal = command->add_subcommand("remove", "Remove a session with its model");
  removal->add_option("ID", arguments->id, "The session, as the list names it")->required();
  removal->fallthrough();  // --socket may stand behind it
  removal->callback([arguments, &context] { finish_command(context, remove(*arguments)); });
  command->footer(kFooter);
  command->callback([command, arguments, &context] {
    if (command->get_subcommands().empty()) {
      finish_command(context, list(arguments->rig));
    }
  });
}

}  // namespace trigmesh
