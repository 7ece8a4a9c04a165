#include "firmware/control/control_server.hpp"

#include <atomic>
#include <cerrno>
#include <charconv>
#include <optional>
#include <thread>
#include <utility>

#include <httplib.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/base/file_bytes.hpp"
#include "firmware/control/control_json.hpp"
#include "firmware/control/control_parse.hpp"
#include "firmware/control/event_log.hpp"
#include "firmware/session/session_id.hpp"

namespace trigmesh {
namespace {

constexpr const char* kJson = "application/json";
constexpr std::size_t kKeptEvents = 256;
constexpr std::size_t kRequestThreads = 4;

void answer_error(httplib::Response& response, int status, std::string_view message) {
  response.status = status;
  response.set_content(render_error(message), kJson);
}

void answer(httplib::Response& response, const Result<std::string>& json) {
  if (json) {
    response.set_content(*json, kJson);
  } else {
    answer_error(response, http_status_of(json.error().code), json.error().message);
  }
}

void answer_done(httplib::Response& response, const Result<>& done) {
  answer(response, done.map([] { return std::string("{}"); }));
}

/// The library waits for a body that was not announced until its time-out.
httplib::Server::HandlerResponse refuse_unknown_length(const httplib::Request& request,
                                                       httplib::Response& response) {
  constexpr int kLengthRequired = 411;
  if (request.method != "POST" || request.has_header("Content-Length") ||
      request.has_header("Transfer-Encoding")) {
    return httplib::Server::HandlerResponse::Unhandled;
  }
  answer_error(response,
               kLengthRequired,
               "a POST must say how long its body is, also when it has none (curl: --data '')");
  return httplib::Server::HandlerResponse::Handled;
}

std::string sse_text(const ControlEvent& event) {
  return fmt::format("id: {}\nevent: {}\ndata: {}\n\n", event.number, event.kind, event.data);
}

/// Of a watcher that comes again; nothing: he wants what happens from now on.
std::optional<std::uint64_t> last_event_of(const httplib::Request& request) {
  const std::string text = request.get_header_value("Last-Event-ID");
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool whole = error == std::errc{} && end == text.data() + text.size();
  return whole ? std::optional(number) : std::nullopt;
}

}  // namespace

Result<> ControlOptions::validate() const {
  constexpr std::size_t kLongestPath = sizeof(sockaddr_un::sun_path) - 1;
  const std::size_t length = socket_path.native().size();
  if (length == 0 || length > kLongestPath || max_watchers == 0 || heartbeat.count() <= 0) {
    return fail(
        ErrorCode::kInvalidArgument,
        "the path of the control socket '{}' must have 1 to {} bytes, max_watchers ({}) and "
        "heartbeat ({} ms) must be greater than 0",
        socket_path.string(),
        kLongestPath,
        max_watchers,
        heartbeat.count());
  }
  return {};
}

class ControlServer::Impl {
 public:
  Impl(ControlTarget& target, const ControlOptions& options)
      : target_(target), options_(options), events_(kKeptEvents) {
    const std::size_t threads = kRequestThreads + options.max_watchers;
    server_.new_task_queue = [threads] { return new httplib::ThreadPool(threads); };
    server_.set_address_family(AF_UNIX);
    server_.set_payload_max_length(options.max_body_bytes);
    // One request a connection: a thread is not held by a client that does nothing.
    server_.set_keep_alive_max_count(1);
    server_.set_read_timeout(std::chrono::seconds(5));
    server_.set_pre_routing_handler(refuse_unknown_length);
    add_routes();
  }

  [[nodiscard]] Result<> bind() {
    const std::string path = options_.socket_path.string();
    if (::unlink(path.c_str()) != 0 && errno != ENOENT) {
      return tl::unexpected<Error>(system_error(errno, "cannot replace", options_.socket_path));
    }
    constexpr int kUnusedPort = 80;
    if (!server_.bind_to_port(path, kUnusedPort)) {
      return fail(
          ErrorCode::kIo, "cannot listen on {}: the folder is missing or not writable", path);
    }
    return {};
  }

  [[nodiscard]] Result<> run() {
    if (stopped_ || entered_.exchange(true)) {
      return {};
    }
    const bool served = server_.listen_after_bind();
    returned_ = true;
    if (!served && !stopped_) {
      return fail(ErrorCode::kIo,
                  "the control socket {} failed; restart the service",
                  options_.socket_path.string());
    }
    return {};
  }

  void stop() {
    if (stopped_.exchange(true)) {
      return;
    }
    events_.close();
    // The library forgets a stop that comes before its loop has begun.
    while (entered_ && !returned_ && !server_.is_running()) {
      std::this_thread::yield();
    }
    server_.stop();
    // The library leaves a socket open that it never served: nobody shall find it and wait.
    (void)::unlink(options_.socket_path.c_str());
  }

  EventLog& events() { return events_; }

 private:
  void add_routes() {
    server_.Get("/v1/status", [this](const httplib::Request&, httplib::Response& response) {
      // The number first: an event that comes between the two is told again rather than missed.
      const std::uint64_t last_event = events_.last_number();
      answer(response, target_.status().map([last_event](ControlStatus status) {
        status.last_event = last_event;
        return render_status(status);
      }));
    });
    server_.Get("/v1/devices", [this](const httplib::Request&, httplib::Response& response) {
      answer(response, target_.devices().map([](const std::vector<DeviceInfo>& devices) {
        return render_devices(devices);
      }));
    });
    server_.Get("/v1/events", [this](const httplib::Request& request, httplib::Response& response) {
      watch(request, response);
    });
    add_command("/v1/start", &ControlTarget::start);
    add_command("/v1/finish", &ControlTarget::finish);
    add_command("/v1/still", &ControlTarget::still);
    add_command("/v1/undo", &ControlTarget::undo);
    add_command("/v1/cancel", &ControlTarget::cancel_model);
    add_session_routes();
    server_.set_error_handler([](const httplib::Request& request, httplib::Response& response) {
      if (response.body.empty()) {
        answer_error(response,
                     response.status,
                     fmt::format("{} {} cannot be done", request.method, request.path));
      }
    });
  }

  void add_command(const char* path, Result<> (ControlTarget::*command)()) {
    server_.Post(path, [this, command](const httplib::Request&, httplib::Response& response) {
      answer_done(response, (target_.*command)());
    });
  }

  void add_session_routes() {
    server_.Get("/v1/sessions", [this](const httplib::Request&, httplib::Response& response) {
      answer(response, target_.sessions().map([](const std::vector<SessionInfo>& sessions) {
        return render_sessions(sessions);
      }));
    });
    server_.Post("/v1/sessions/([^/]+)/continue",
                 [this](const httplib::Request& request, httplib::Response& response) {
                   const std::string id = request.matches[1];
                   answer_done(response,
                               check_id(id).and_then([&] { return target_.continue_session(id); }));
                 });
    server_.Post("/v1/sessions/([^/]+)/export",
                 [this](const httplib::Request& request, httplib::Response& response) {
                   answer(response, export_session(request.matches[1], request.body));
                 });
    server_.Delete("/v1/sessions/([^/]+)",
                   [this](const httplib::Request& request, httplib::Response& response) {
                     const std::string id = request.matches[1];
                     answer_done(response,
                                 check_id(id).and_then([&] { return target_.remove_session(id); }));
                   });
  }

  [[nodiscard]] static Result<> check_id(const std::string& id) {
    if (!is_session_id(id)) {
      return fail(ErrorCode::kInvalidArgument, "'{}' is not the id of a session", id);
    }
    return {};
  }

  [[nodiscard]] Result<std::string> export_session(const std::string& id, std::string_view body) {
    TM_RETURN_IF_ERROR(check_id(id));
    TM_ASSIGN_OR_RETURN(const std::filesystem::path destination, parse_export_request(body));
    return target_.export_session(id, destination).map(render_export);
  }

  void watch(const httplib::Request& request, httplib::Response& response) {
    if (watchers_.fetch_add(1) >= options_.max_watchers) {
      --watchers_;
      answer_error(
          response,
          503,
          fmt::format("{} watchers are connected already, the limit", options_.max_watchers));
      return;
    }
    auto after =
        std::make_shared<std::uint64_t>(last_event_of(request).value_or(events_.last_number()));
    response.set_chunked_content_provider(
        "text/event-stream",
        [this, after](std::size_t /*offset*/, httplib::DataSink& sink) {
          return send_events(*after, sink);
        },
        [this](bool /*success*/) { --watchers_; });
  }

  /// False ends the connection.
  bool send_events(std::uint64_t& after, httplib::DataSink& sink) {
    std::string text;
    for (const ControlEvent& event : events_.wait_after(after, options_.heartbeat)) {
      text += sse_text(event);
      after = event.number;
    }
    if (text.empty()) {
      text = ": nothing new\n\n";
    }
    const bool sent = sink.write(text.data(), text.size());
    if (events_.is_closed()) {
      sink.done();
      return sent;
    }
    return sent;
  }

  ControlTarget& target_;
  ControlOptions options_;
  EventLog events_;
  httplib::Server server_;
  std::atomic<std::size_t> watchers_ = 0;
  std::atomic<bool> entered_ = false;
  std::atomic<bool> returned_ = false;
  std::atomic<bool> stopped_ = false;
};

ControlServer::ControlServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

ControlServer::~ControlServer() = default;

Result<std::unique_ptr<ControlServer>> ControlServer::create(ControlTarget& target,
                                                             const ControlOptions& options) {
  TM_RETURN_IF_ERROR(options.validate());
  auto impl = std::make_unique<Impl>(target, options);
  TM_RETURN_IF_ERROR(impl->bind());
  return std::unique_ptr<ControlServer>(new ControlServer(std::move(impl)));
}

Result<> ControlServer::run() {
  return impl_->run();
}

void ControlServer::stop() {
  impl_->stop();
}

void ControlServer::publish(const std::string& kind, const std::string& json) {
  impl_->events().publish(kind, json);
}

}  // namespace trigmesh
