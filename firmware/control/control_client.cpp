#include "firmware/control/control_client.hpp"

#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <memory>
#include <mutex>
#include <string_view>
#include <system_error>
#include <utility>

#include <httplib.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <fmt/format.h>

#include "firmware/base/check.hpp"
#include "firmware/base/unique_fd.hpp"
#include "firmware/control/control_json.hpp"
#include "firmware/control/control_parse.hpp"
#include "firmware/control/event_stream.hpp"

namespace trigmesh {
namespace {

namespace fs = std::filesystem;

constexpr const char* kJson = "application/json";
constexpr int kHttpOk = 200;
constexpr std::chrono::milliseconds kRetryInterval{100};
/// Longest silence of a watched server, whose sign of life comes more often.
constexpr std::chrono::seconds kWatchTimeout{30};
/// Work on a slow stick may take hours.
constexpr std::chrono::hours kWorkTimeout{24};

Error connection_error(int error_number, const fs::path& socket) {
  const std::string reason = std::generic_category().message(error_number);
  if (error_number == EACCES || error_number == EPERM) {
    return {ErrorCode::kIo,
            fmt::format("cannot connect to the rig at {}: {}; add yourself to the group trigmesh "
                        "(sudo adduser $USER trigmesh) and log in again",
                        socket.string(),
                        reason)};
  }
  return {ErrorCode::kIo,
          fmt::format("cannot connect to the rig at {}: {}; is trigmeshd running? See: systemctl "
                      "status trigmesh",
                      socket.string(),
                      reason)};
}

std::unique_ptr<httplib::Client> connect_to(const fs::path& socket,
                                            std::chrono::milliseconds timeout) {
  auto client = std::make_unique<httplib::Client>(socket.string());
  client->set_address_family(AF_UNIX);
  client->set_default_headers({{"Host", "rig"}});
  client->set_read_timeout(timeout);
  return client;
}

Result<std::string> body_of(const httplib::Response& response) {
  if (response.status >= 200 && response.status < 300) {
    return response.body;
  }
  return tl::unexpected<Error>(Error{error_code_of(response.status), parse_error(response.body)});
}

}  // namespace

/// What a watcher knows between two connections.
struct ControlClient::Watch {
  std::optional<std::uint64_t> after;
  const std::function<bool(const ControlEvent&)>& on_event;
  bool done = false;
};

ControlClient::ControlClient(ControlClientOptions options) : options_(std::move(options)) {}

Result<> ControlClient::check_connection() const {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string& path = options_.socket_path.native();
  if (path.empty() || path.size() >= sizeof(address.sun_path)) {
    return fail(ErrorCode::kInvalidArgument,
                "the path of the control socket '{}' must have 1 to {} bytes",
                path,
                sizeof(address.sun_path) - 1);
  }
  std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
  const UniqueFd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (!fd.valid() ||
      ::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0) {
    return tl::unexpected<Error>(connection_error(errno, options_.socket_path));
  }
  return {};
}

Result<std::string> ControlClient::ask(std::chrono::milliseconds timeout,
                                       const Request& request) const {
  const auto client = connect_to(options_.socket_path, timeout);
  const httplib::Result response = request(*client);
  if (response) {
    return body_of(*response);
  }
  TM_RETURN_IF_ERROR(check_connection());
  return fail(ErrorCode::kIo,
              "the rig at {} gave no answer ({}); see: journalctl -u trigmesh",
              options_.socket_path.string(),
              httplib::to_string(response.error()));
}

Result<std::string> ControlClient::get(const std::string& path) const {
  return ask(options_.answer_timeout, [&](httplib::Client& client) { return client.Get(path); });
}

Result<std::string> ControlClient::post(const std::string& path) const {
  return ask(options_.answer_timeout, [&](httplib::Client& client) { return client.Post(path); });
}

Result<std::string> ControlClient::remove(const std::string& path) const {
  return ask(options_.answer_timeout, [&](httplib::Client& client) { return client.Delete(path); });
}

Result<std::string> ControlClient::post_and_wait(const std::string& path,
                                                 const std::string& json) const {
  return ask(kWorkTimeout, [&](httplib::Client& client) { return client.Post(path, json, kJson); });
}

Result<> ControlClient::watch(std::optional<std::uint64_t> after,
                              const std::function<bool(const ControlEvent&)>& on_event,
                              const std::stop_token& stop) const {
  Watch watch{after, on_event};
  while (!stop.stop_requested()) {
    TM_RETURN_IF_ERROR(watch_once(watch, stop));
    if (watch.done) {
      return {};
    }
    TM_RETURN_IF_ERROR(wait_for_service(stop));
  }
  return {};
}

/// Until the connection ends. An Error is one that coming again does not mend.
Result<> ControlClient::watch_once(Watch& watch, const std::stop_token& stop) const {
  const auto client = connect_to(options_.socket_path, kWatchTimeout);
  const std::stop_callback end_connection(stop, [&] { client->stop(); });
  httplib::Headers headers;
  if (watch.after) {
    headers.emplace("Last-Event-ID", std::to_string(*watch.after));
  }
  EventStreamReader reader;
  Result<> outcome;
  std::string refusal;
  int status = 0;
  const auto take = [&](const char* data, std::size_t size) {
    if (status != kHttpOk) {
      refusal.append(data, size);
      return true;
    }
    const auto events = reader.add({data, size});
    if (!events) {
      outcome = tl::unexpected<Error>(events.error());
      return false;
    }
    return deliver(*events, watch) && !stop.stop_requested();
  };
  // A stop that comes before the connection is open would be forgotten.
  const auto begin = [&](const httplib::Response& response) {
    status = response.status;
    return !stop.stop_requested();
  };
  const httplib::Result response = client->Get("/v1/events", headers, begin, take);
  if (status != 0 && status != kHttpOk) {
    return tl::unexpected<Error>(Error{error_code_of(status), parse_error(refusal)});
  }
  if (status == 0 && !response && !stop.stop_requested()) {
    return check_connection();
  }
  return outcome;
}

bool ControlClient::deliver(const std::vector<ControlEvent>& events, Watch& watch) {
  for (const ControlEvent& event : events) {
    watch.after = event.number;
    if (!watch.on_event(event)) {
      watch.done = true;
      return false;
    }
  }
  return true;
}

/// Returns when somebody listens again, or a stop is requested.
Result<> ControlClient::wait_for_service(const std::stop_token& stop) const {
  std::mutex mutex;
  std::condition_variable_any stopped;
  const auto give_up = std::chrono::steady_clock::now() + options_.reconnect_for;
  while (true) {
    std::unique_lock lock(mutex);
    (void)stopped.wait_for(lock, stop, kRetryInterval, [] { return false; });
    const Result<> connected = check_connection();
    if (connected || stop.stop_requested()) {
      return {};
    }
    if (std::chrono::steady_clock::now() >= give_up) {
      return connected;
    }
  }
}

}  // namespace trigmesh
