#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>

#include "firmware/base/result.hpp"
#include "firmware/control/control_target.hpp"

namespace trigmesh {

struct ControlOptions {
  /// Of the unix socket; what is there is replaced. Who may connect is decided by the folder.
  std::filesystem::path socket_path;
  /// Largest body of a request, bytes; a path fits. Larger ones get 413.
  std::size_t max_body_bytes = 4096;
  /// Watchers of events at once; each holds a thread. More get 503. > 0.
  std::size_t max_watchers = 4;
  /// How often a watcher without events gets a sign of life. > 0.
  std::chrono::milliseconds heartbeat{5000};

  [[nodiscard]] Result<> validate() const;
};

/// The rig over HTTP on a unix socket:
///
///     GET  /v1/status     what it is doing
///     POST /v1/start, /v1/finish, /v1/still, /v1/undo, /v1/cancel
///     GET  /v1/sessions   the list
///     POST /v1/sessions/ID/export   {"destination": "/media/stick"}; answers when it is done
///     DELETE /v1/sessions/ID
///     GET  /v1/devices    cameras and GPIO chips
///     GET  /v1/events     server-sent events, from now on or after the header Last-Event-ID
///
/// Answers are JSON; a failure is {"error": ".."} with a fitting status. Used as
///
///     TM_ASSIGN_OR_RETURN(auto server, ControlServer::create(target, options));
///     std::jthread thread([&] { server->run(); });
///     server->publish("phase", "{..}");   // from any thread
///     server->stop();
///
/// Thread-safe.
class ControlServer {
 public:
  /// Binds the socket: clients can connect from then on, and are answered when run() is called.
  /// `target` outlives the server. kInvalidArgument, kIo.
  [[nodiscard]] static Result<std::unique_ptr<ControlServer>> create(ControlTarget& target,
                                                                     const ControlOptions& options);

  ControlServer(const ControlServer&) = delete;
  ControlServer& operator=(const ControlServer&) = delete;
  ControlServer(ControlServer&&) = delete;
  ControlServer& operator=(ControlServer&&) = delete;
  /// stop() was called and run() has returned, or was never called.
  ~ControlServer();

  /// Serves until stop(). kIo when the socket fails. Once.
  [[nodiscard]] Result<> run();

  /// Ends run(), at once or before it begins, and all watching.
  void stop();

  /// Tells all watchers. `kind`: letters; `json`: one line.
  void publish(const std::string& kind, const std::string& json);

 private:
  class Impl;
  explicit ControlServer(std::unique_ptr<Impl> impl);

  std::unique_ptr<Impl> impl_;
};

}  // namespace trigmesh
