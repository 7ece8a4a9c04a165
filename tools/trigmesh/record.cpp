// trigmesh record: one session from a terminal, from its beginning to its end.

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <utility>

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/control/control_events.hpp"
#include "firmware/control/control_parse.hpp"
#include "tools/trigmesh/command.hpp"
#include "tools/trigmesh/interrupt.hpp"
#include "tools/trigmesh/rig_client.hpp"

namespace trigmesh {
namespace {

constexpr const char* kFooter =
    R"(Begins a session, shows how many frames it has, and closes it at Ctrl-C, after --seconds or at --frames. In still
mode frames come from the button or `trigmesh trigger still`. Prints the id of the session and its folder.

Examples:
  trigmesh record
  trigmesh record --seconds 20 && trigmesh watch --until model
  id=$(trigmesh record --frames 50 | head -n 1)
)";

struct RecordArguments {
  RigArguments rig;
  double seconds = 0.0;
  std::uint32_t frames = 0;
};

/// Ends a recording: when it is interrupted or its time is over.
class RecordingEnd {
 public:
  RecordingEnd(const std::stop_token& interrupt, double seconds)
      : interrupted_(interrupt, [this] { end_.request_stop(); }) {
    if (seconds > 0.0) {
      timer_ = std::jthread([this, seconds](const std::stop_token& stop) {
        std::mutex mutex;
        std::condition_variable_any stopped;
        std::unique_lock lock(mutex);
        (void)stopped.wait_for(
            lock, stop, std::chrono::duration<double>(seconds), [] { return false; });
        end_.request_stop();
      });
    }
  }

  [[nodiscard]] std::stop_token token() const { return end_.get_token(); }

 private:
  std::stop_source end_;
  std::stop_callback<std::function<void()>> interrupted_;
  std::jthread timer_;
};

/// Shows frames as they come.
class FrameCounter {
 public:
  /// `status`: of the rig when the session had been begun.
  FrameCounter(const ControlStatus& status, std::uint32_t wanted)
      : session_id_(status.session_id), wanted_(wanted), frames_(status.frames) {}

  /// Whether to go on: not with the last frame that is wanted, or when the rig closed the session.
  [[nodiscard]] bool take(const ControlEvent& event) {
    if (event.kind == kFrameEvent) {
      if (const auto frames = parse_frame_event(event.data)) {
        frames_ = *frames;
        show();
      }
      return !is_enough();
    }
    if (event.kind == kPhaseEvent) {
      const auto session = parse_phase_session(event.data);
      is_open_ = !session || *session == session_id_;
    }
    return is_open_;
  }

  [[nodiscard]] bool is_enough() const { return wanted_ > 0 && frames_ >= wanted_; }

  [[nodiscard]] std::uint32_t frames() const { return frames_; }

  [[nodiscard]] bool is_open() const { return is_open_; }

 private:
  void show() const {
    const bool on_terminal = ::isatty(STDERR_FILENO) != 0;
    fmt::print(stderr, "{}{} frames{}", on_terminal ? "\r" : "", frames_, on_terminal ? "" : "\n");
  }

  std::string session_id_;
  std::uint32_t wanted_;
  std::uint32_t frames_;
  bool is_open_ = true;
};

/// The status when the session that was asked for is there: the storage opens it a moment later.
Result<ControlStatus> wait_for_session(const ControlClient& client, const std::stop_token& stop) {
  Result<ControlStatus> status = ask_status(client);
  const auto is_decided = [&] {
    return !status || !status->session_id.empty() || status->phase != RigPhase::kCapturing;
  };
  if (!is_decided()) {
    TM_RETURN_IF_ERROR(client.watch(
        status->last_event,
        [&](const ControlEvent& /*event*/) {
          status = ask_status(client);
          return !is_decided();
        },
        stop));
  }
  if (status && status->session_id.empty()) {
    return fail(ErrorCode::kIo,
                "the rig began no session{}{}",
                status->fault.empty() ? "" : ": ",
                status->fault);
  }
  return status;
}

Result<ControlStatus> begin(const ControlClient& client, const std::stop_token& stop) {
  TM_ASSIGN_OR_RETURN(const ControlStatus before, ask_status(client));
  if (!before.session_id.empty()) {
    return fail(ErrorCode::kInsufficientData,
                "session {} is open already; close it with: trigmesh trigger finish",
                before.session_id);
  }
  TM_RETURN_IF_ERROR(client.post("/v1/start"));
  return wait_for_session(client, stop);
}

void tell(const ControlStatus& status, std::uint32_t frames) {
  if (::isatty(STDERR_FILENO) != 0) {
    fmt::print(stderr, "\n");
  }
  fmt::print("{}\n", status.session_id);
  if (!status.session_root.empty()) {
    fmt::print("{} frames in {}/{}\n", frames, status.session_root, status.session_id);
  }
}

Result<> run(const RecordArguments& arguments) {
  const InterruptWatch interrupt;
  const ControlClient client = arguments.rig.client();
  TM_ASSIGN_OR_RETURN(const ControlStatus status, begin(client, interrupt.token()));
  const RecordingEnd end(interrupt.token(), arguments.seconds);
  FrameCounter counter(status, arguments.frames);
  Result<> watched;
  if (!counter.is_enough()) {
    watched = client.watch(
        status.last_event,
        [&](const ControlEvent& event) { return counter.take(event); },
        end.token());
  }
  if (counter.is_open()) {  // also when the watch failed: the rig shall not go on unseen
    TM_RETURN_IF_ERROR(client.post("/v1/finish"));
  }
  TM_RETURN_IF_ERROR(watched);
  tell(status, counter.frames());
  return {};
}

}  // namespace

void add_record_command(CLI::App& app, CommandContext& context) {
  CLI::App* command = app.add_subcommand("record", "Rig: capture one session");
  const auto arguments = std::make_shared<RecordArguments>();  // shared by the callback's copies
  add_socket_option(*command, arguments->rig);
  command->add_option("--seconds", arguments->seconds, "End after this time")
      ->check(CLI::PositiveNumber)
      ->option_text("N");
  command->add_option("--frames", arguments->frames, "End when so many frames are kept")
      ->check(CLI::PositiveNumber)
      ->option_text("N");
  command->footer(kFooter);
  command->callback([arguments, &context] { finish_command(context, run(*arguments)); });
}

}  // namespace trigmesh
