#include "firmware/daemon/service.hpp"

#include <algorithm>
#include <array>

#include <poll.h>
#include <sys/signalfd.h>

#include <fmt/format.h>
#include <systemd/sd-daemon.h>

#include "firmware/daemon/logging.hpp"

namespace trigmesh {
namespace {

using std::chrono::nanoseconds;

/// How often the status is told when nobody watches.
constexpr std::chrono::seconds kStatusInterval(2);

std::string_view name_of(RigPhase phase) {
  switch (phase) {
    case RigPhase::kIdle:
      return "ready";
    case RigPhase::kCapturing:
      return "capturing";
    case RigPhase::kWorking:
      return "making a model";
    case RigPhase::kFault:
      return "fault";
  }
  return "unknown";
}

std::string status_text(const Daemon& daemon) {
  const ControlStatus status = daemon.status().status();
  std::string text(name_of(status.phase));
  if (!status.session_id.empty()) {
    text += fmt::format(", session {} with {} frames", status.session_id, status.frames);
  }
  const std::string faults = daemon.faults().text();
  return faults.empty() ? text : fmt::format("{}; {}", text, faults);
}

}  // namespace

void ServiceManager::ready() {
  (void)sd_notify(0, "READY=1");  // without a manager nobody waits for it; likewise below
}

void ServiceManager::stopping() {
  (void)sd_notify(0, "STOPPING=1");
}

void ServiceManager::status(const std::string& text) {
  if (text != status_) {
    status_ = text;
    (void)sd_notify(0, fmt::format("STATUS={}", text).c_str());
  }
}

void ServiceManager::watchdog() {
  (void)sd_notify(0, "WATCHDOG=1");
}

std::optional<std::chrono::microseconds> ServiceManager::watchdog_interval() {
  std::uint64_t interval_us = 0;
  if (sd_watchdog_enabled(0, &interval_us) <= 0) {
    return std::nullopt;
  }
  return std::chrono::microseconds(interval_us);
}

std::optional<std::string> RigWatch::trouble(nanoseconds now) {
  if (const auto name = daemon_.heartbeats().hung(turn_limit_)) {
    return fmt::format("the thread '{}' hangs", *name);
  }
  const JobState job = daemon_.status().status().job;
  const bool is_running = job == JobState::kRunning || job == JobState::kPausing;
  if (!progress_.gets_on(is_running, daemon_.models().progress_count(), now)) {
    return "the work on the model does not get on";
  }
  return std::nullopt;
}

EndSignals::EndSignals()
    : fd_([] {
        sigset_t signals;
        sigemptyset(&signals);
        sigaddset(&signals, SIGINT);
        sigaddset(&signals, SIGTERM);
        pthread_sigmask(SIG_BLOCK, &signals, nullptr);
        return ::signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK);
      }()) {}

void serve(Daemon& daemon, const EndSignals& signals, RigWatch& watch, const Clock& clock) {
  ServiceManager manager;
  const auto interval = ServiceManager::watchdog_interval();
  const nanoseconds turn =
      interval ? std::min<nanoseconds>(*interval / 4, kStatusInterval) : kStatusInterval;
  std::array<pollfd, 3> watched = {pollfd{signals.fd(), POLLIN, 0},
                                   pollfd{daemon.ended().fd(), POLLIN, 0},
                                   pollfd{daemon.camera_tried().fd(), POLLIN, 0}};
  bool is_in_trouble = false;
  while (!daemon.ended().is_set()) {
    if (poll_until(watched, turn, clock) < 0) {
      write_log(LogLevel::kError, "cannot wait for signals; the program ends");
      daemon.request_end();
    }
    if (watched[2].fd >= 0 && daemon.camera_tried().is_set()) {
      watched[2].fd = -1;  // poll leaves it out
      manager.ready();
    }
    signalfd_siginfo signal{};
    if (::read(signals.fd(), &signal, sizeof(signal)) == sizeof(signal)) {
      write_log(LogLevel::kInfo, fmt::format("signal {}: the program ends", signal.ssi_signo));
      manager.stopping();
      daemon.request_end();
    }
    manager.status(status_text(daemon));
    const auto trouble = watch.trouble(clock.now());
    if (trouble && !is_in_trouble) {
      write_log(LogLevel::kError, fmt::format("{}; the watchdog is not fed", *trouble));
    } else if (!trouble) {
      manager.watchdog();
    }
    is_in_trouble = trouble.has_value();
  }
}

}  // namespace trigmesh
