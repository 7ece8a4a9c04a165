// The service of the rig; see README.md.

#include <cstdio>
#include <exception>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include <malloc.h>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "firmware/base/file_system.hpp"
#include "firmware/control/control_server.hpp"
#include "firmware/daemon/backends.hpp"
#include "firmware/daemon/check.hpp"
#include "firmware/daemon/daemon.hpp"
#include "firmware/daemon/logging.hpp"
#include "firmware/daemon/rig_options.hpp"
#include "firmware/daemon/service.hpp"
#include "firmware/settings/settings.hpp"

namespace {

using namespace trigmesh;

constexpr int kEndedInOrder = 0;
constexpr int kFailed = 1;
constexpr int kWrongCommandLine = 2;
constexpr int kWrongSettings = 3;

constexpr const char* kFooter = R"(Examples:
  trigmeshd
  trigmeshd --check
  trigmeshd --settings rig.toml --socket /tmp/rig.sock

Exit codes:
  0  stopped in order (SIGTERM, SIGINT), or --check found no wrong setting
  1  failure: the log says what
  2  wrong command line
  3  wrong settings: all of them are named with file and line
)";

struct Arguments {
  std::string settings = "/etc/trigmesh/trigmesh.toml";
  std::string socket = "/run/trigmesh/control.sock";
  bool check = false;
};

int check(const Settings& settings, const Arguments& arguments) {
  const SteadyClock clock;
  const auto sentences = unusable_now(settings, real_file_system(), clock);
  for (const std::string& sentence : sentences) {
    fmt::print("warning: {}\n", sentence);
  }
  fmt::print("{}: the settings are right{}\n",
             arguments.settings,
             sentences.empty() ? "" : "; what is named above cannot be used now");
  return kEndedInOrder;
}

LogLevel level_of(LogSettings::Level level) {
  switch (level) {
    case LogSettings::Level::kError:
      return LogLevel::kError;
    case LogSettings::Level::kWarn:
      return LogLevel::kWarn;
    case LogSettings::Level::kDebug:
      return LogLevel::kDebug;
    case LogSettings::Level::kInfo:
      break;
  }
  return LogLevel::kInfo;
}

int give_up(const Error& error) {
  write_log(LogLevel::kError, fmt::format("cannot start: {}", error.message));
  return kFailed;
}

/// How long a thread may take for a turn: half of what the service manager waits.
std::chrono::nanoseconds turn_limit() {
  constexpr std::chrono::seconds kWithoutManager(30);
  const auto interval = ServiceManager::watchdog_interval();
  return interval ? std::chrono::nanoseconds(*interval) / 2 : kWithoutManager;
}

int run_rig(const Settings& settings, const Arguments& arguments) {
  const EndSignals signals;  // before any thread begins
  if (!signals.valid()) {
    return give_up({ErrorCode::kIo, "the system has no file descriptors left"});
  }
  const SteadyClock clock;
  const SystemWallClock wall_clock;
  auto profile = read_profile(settings);
  if (!profile) {
    write_log(LogLevel::kWarn,
              fmt::format("camera.profile is left out: {}", profile.error().message));
  }
  auto devices = make_devices(settings, clock);
  if (!devices) {
    return give_up(devices.error());
  }
  ControlServer* server_to_tell = nullptr;  // set before the threads begin
  Daemon daemon(options_of_settings(settings, profile.value_or(""), TRIGMESH_VERSION),
                *std::move(devices),
                {real_file_system(), clock, wall_clock},
                [&server_to_tell](std::string_view kind, const std::string& json) {
                  server_to_tell->publish(std::string(kind), json);
                });
  ControlOptions control;
  control.socket_path = arguments.socket;
  auto server = ControlServer::create(daemon.target(), control);
  if (!server) {
    return give_up(server.error());
  }
  server_to_tell = server->get();
  daemon.start();
  std::jthread control_thread([&server] {
    if (const auto served = (*server)->run(); !served) {
      write_log(LogLevel::kError, served.error().message);
    }
  });
  RigWatch watch(daemon, turn_limit(), settings.reconstruction.stall_limit);
  serve(daemon, signals, watch, clock);
  (*server)->stop();
  daemon.stop();
  control_thread.join();
  write_log(LogLevel::kInfo, "stopped in order");
  return kEndedInOrder;
}

int run(int argc, char** argv) {
  CLI::App app{"The service of the rig: press the trigger, get a mesh.", "trigmeshd"};
  app.set_version_flag("--version", "trigmeshd " TRIGMESH_VERSION);
  app.footer(kFooter);
  Arguments arguments;
  app.add_option("--settings", arguments.settings, "File with the settings")->capture_default_str();
  app.add_option("--socket", arguments.socket, "Unix socket of the control interface")
      ->capture_default_str();
  app.add_flag("--check", arguments.check, "Say what is wrong with the settings, and end");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {
      return app.exit(error);  // --help, --version
    }
    fmt::print(stderr, "trigmeshd: {}\nRun with --help for more information.\n", error.what());
    return kWrongCommandLine;
  }
  const auto settings = load_settings(arguments.settings);
  if (!settings) {
    fmt::print(stderr, "trigmeshd: wrong settings\n{}\n", settings.error().message);
    return kWrongSettings;
  }
  if (arguments.check) {
    return check(*settings, arguments);
  }
  set_up_logging(log_target(), level_of(settings->log.level));
  return run_rig(*settings, arguments);
}

}  // namespace

int main(int argc, char** argv) {
  // Pictures go back to the system when they are freed: glibc would raise this threshold with each
  // of them and keep their memory.
  ::mallopt(M_MMAP_THRESHOLD, 1 << 20);
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "trigmeshd: internal error: {}\n", error.what());
    return kFailed;
  }
}
