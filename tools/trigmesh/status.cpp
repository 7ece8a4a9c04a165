// trigmesh status: what the rig is doing.

#include <memory>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/control/control_json.hpp"
#include "firmware/control/control_parse.hpp"
#include "tools/trigmesh/command.hpp"
#include "tools/trigmesh/rig_client.hpp"

namespace trigmesh {
namespace {

constexpr const char* kFooter = R"(Examples:
  trigmesh status
  trigmesh status --json | jq -r .phase
)";

std::string model_line(const ControlStatus& status) {
  std::string line = "none is made";
  if (!status.model_session_id.empty()) {
    line = fmt::format("of {}: {}", status.model_session_id, to_string(status.job));
    if (!status.model_stage.empty()) {
      line += fmt::format(", {} {}", status.model_stage, status.model_done);
    }
    if (status.model_total > 0) {
      line += fmt::format(" of {}", status.model_total);
    }
  }
  if (status.queued_models > 0) {
    line += fmt::format("; {} waiting", status.queued_models);
  }
  return line;
}

void print(const ControlStatus& status) {
  fmt::print("rig       {}, {}\n",
             to_string(status.phase),
             status.camera_present ? "camera is there" : "no camera");
  if (!status.advice.empty()) {
    fmt::print("advice    {}\n", status.advice);
  }
  if (!status.fault.empty()) {
    fmt::print("fault     {}\n", status.fault);
  }
  fmt::print("session   {}\n",
             status.session_id.empty()
                 ? "none is open"
                 : fmt::format("{}, {} frames", status.session_id, status.frames));
  fmt::print("model     {}\n", model_line(status));
  fmt::print(
      "storage   {}, room for {}\n", to_string(status.storage), size_text(status.available_bytes));
  fmt::print("software  {}\n", status.software_version);
}

Result<> run(const RigArguments& arguments) {
  TM_ASSIGN_OR_RETURN(const std::string answer, arguments.client().get("/v1/status"));
  if (arguments.json) {
    fmt::print("{}\n", answer);
    return {};
  }
  return parse_status(answer).map(print);
}

}  // namespace

void add_status_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("status", "Rig: say what it is doing");
  const auto arguments = std::make_shared<RigArguments>();  // shared by the callback's copies
  add_rig_options(*command, *arguments);
  command->footer(kFooter);
  command->callback([arguments, &context] { finish_command(context, run(*arguments)); });
}

}  // namespace trigmesh
