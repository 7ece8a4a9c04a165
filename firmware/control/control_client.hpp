#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "firmware/base/result.hpp"
#include "firmware/control/event_log.hpp"

namespace httplib {
class Client;
class Result;
}  // namespace httplib

namespace trigmesh {

struct ControlClientOptions {
  std::filesystem::path socket_path = "/run/trigmesh/control.sock";
  /// Longest wait for an answer, except for what takes as long as its work.
  std::chrono::milliseconds answer_timeout{10000};
  /// How long a watcher tries to find the service again when it went away.
  std::chrono::milliseconds reconnect_for{10000};
};

/// The other end of ControlServer, for the command line. Bodies are JSON, see control_parse. Errors
/// of the rig come back as their Error; kIo when nobody listens (the service does not run), when
/// the caller may not connect, or when no answer comes: the message says what to do. Thread-safe.
class ControlClient {
 public:
  explicit ControlClient(ControlClientOptions options);

  /// Whether somebody listens.
  [[nodiscard]] Result<> check_connection() const;

  [[nodiscard]] Result<std::string> get(const std::string& path) const;
  [[nodiscard]] Result<std::string> post(const std::string& path) const;
  [[nodiscard]] Result<std::string> remove(const std::string& path) const;
  /// For requests that are answered when their work is done: waits as long as that takes.
  [[nodiscard]] Result<std::string> post_and_wait(const std::string& path,
                                                  const std::string& json) const;

  /// Calls `on_event` for each event after number `after` (without: from now on) until it returns
  /// false or a stop is requested; both are no failure. A connection that is lost is made again
  /// behind the last event that came. Blocks.
  [[nodiscard]] Result<> watch(std::optional<std::uint64_t> after,
                               const std::function<bool(const ControlEvent&)>& on_event,
                               const std::stop_token& stop) const;

 private:
  struct Watch;

  using Request = std::function<httplib::Result(httplib::Client&)>;

  [[nodiscard]] Result<std::string> ask(std::chrono::milliseconds timeout,
                                        const Request& request) const;
  [[nodiscard]] static bool deliver(const std::vector<ControlEvent>& events, Watch& watch);
  [[nodiscard]] Result<> watch_once(Watch& watch, const std::stop_token& stop) const;
  [[nodiscard]] Result<> wait_for_service(const std::stop_token& stop) const;

  ControlClientOptions options_;
};

}  // namespace trigmesh
