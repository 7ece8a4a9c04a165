// trigmesh watch: events of the rig as they happen.

#include <cstdint>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "firmware/base/check.hpp"
#include "firmware/control/control_events.hpp"
#include "firmware/control/control_parse.hpp"
#include "tools/trigmesh/command.hpp"
#include "tools/trigmesh/interrupt.hpp"
#include "tools/trigmesh/rig_client.hpp"

namespace trigmesh {
namespace {

constexpr const char* kFooter = R"(Shows events from now on, a line each, until Ctrl-C, or
  --until idle   nothing is captured and no model is made or waits: at once when it is so already
  --until model  the next model is ready; when it could not be made: exit code 4
A service that is started again is found again.

Examples:
  trigmesh watch
  trigmesh watch --until idle && trigmesh export 20261125T145054Z-3fa9c1 /media/stick
  trigmesh watch --json
)";

enum class Until { kInterrupted, kIdle, kModel };

struct WatchArguments {
  RigArguments rig;
  std::string until;
  std::optional<std::uint64_t> after;

  [[nodiscard]] Until goal() const {
    return until == "idle" ? Until::kIdle : until == "model" ? Until::kModel : Until::kInterrupted;
  }
};

/// "frame  session=2026.. frames=3": the data of an event for people.
std::string line_of(const ControlEvent& event) {
  std::string line = fmt::format("{:<8}", event.kind);
  const auto data = nlohmann::ordered_json::parse(event.data, nullptr, /*allow_exceptions=*/false);
  if (!data.is_object()) {
    return line + " " + event.data;
  }
  for (const auto& [key, value] : data.items()) {
    line += fmt::format(" {}={}", key, value.is_string() ? value.get<std::string>() : value.dump());
  }
  return line;
}

std::string json_of(const ControlEvent& event) {
  return fmt::format(
      R"({{"number":{},"event":"{}","data":{}}})", event.number, event.kind, event.data);
}

/// Shows events until the goal is reached.
class Watcher {
 public:
  Watcher(const WatchArguments& arguments, const ControlClient& client)
      : arguments_(arguments), client_(client) {}

  /// Whether to go on.
  [[nodiscard]] bool take(const ControlEvent& event) {
    fmt::print("{}\n", arguments_.rig.json ? json_of(event) : line_of(event));
    std::fflush(stdout);  // the reader may be a pipe
    switch (arguments_.goal()) {
      case Until::kInterrupted:
        return true;
      case Until::kIdle:
        return event.kind == kProgressEvent || !look_for_idle();
      case Until::kModel:
        return event.kind != kModelEvent || !look_at_model(event);
    }
    return true;
  }

  [[nodiscard]] const Result<>& outcome() const { return outcome_; }

  [[nodiscard]] bool reached() const { return reached_; }

 private:
  [[nodiscard]] bool look_for_idle() {
    const auto status = ask_status(client_);
    reached_ = status && is_idle(*status);
    return reached_;  // without an answer the watch itself will tell
  }

  [[nodiscard]] bool look_at_model(const ControlEvent& event) {
    reached_ = true;
    const auto model = parse_model_event(event.data);
    if (!model) {
      outcome_ = tl::unexpected<Error>(model.error());
    } else if (model->outcome != ModelEventOutcome::kReady) {
      outcome_ = fail(ErrorCode::kInsufficientData,
                      "session {} has no model: {}",
                      model->session_id,
                      model->message);
    }
    return true;
  }

  const WatchArguments& arguments_;
  const ControlClient& client_;
  Result<> outcome_;
  bool reached_ = false;
};

Result<> run(const WatchArguments& arguments) {
  const InterruptWatch interrupt;
  const ControlClient client = arguments.rig.client();
  TM_ASSIGN_OR_RETURN(const ControlStatus status, ask_status(client));
  if (arguments.goal() == Until::kIdle && is_idle(status)) {
    return {};
  }
  Watcher watcher(arguments, client);
  TM_RETURN_IF_ERROR(client.watch(
      arguments.after.value_or(status.last_event),
      [&](const ControlEvent& event) { return watcher.take(event); },
      interrupt.token()));
  if (arguments.goal() != Until::kInterrupted && !watcher.reached()) {
    return fail(
        ErrorCode::kCancelled, "interrupted before --until {} was reached", arguments.until);
  }
  return watcher.outcome();
}

}  // namespace

void add_watch_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("watch", "Rig: show events as they happen");
  const auto arguments = std::make_shared<WatchArguments>();  // shared by the callback's copies
  add_rig_options(*command, arguments->rig);
  command->add_option("--until", arguments->until, "End when the rig is idle, or has made a model")
      ->check(CLI::IsMember({"idle", "model"}));
  command
      ->add_option("--after",
                   arguments->after,
                   "Begin after this event, the last_event of an earlier status")
      ->option_text("NUMBER");
  command->footer(kFooter);
  command->callback([arguments, &context] { finish_command(context, run(*arguments)); });
}

}  // namespace trigmesh
