#pragma once

#include <atomic>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "firmware/control/control_server.hpp"

namespace trigmesh::test_support {

/// Ids of the sessions that a FakeRig has.
inline constexpr const char* kReadySession = "20240229T235959Z-00ff00";
inline constexpr const char* kClosedSession = "20240301T000000Z-00ff01";

/// A rig without camera or storage: counts what it is asked, in words.
class FakeRig final : public ControlTarget {
 public:
  Result<ControlStatus> status() override;

  Result<> start() override { return command("start"); }

  Result<> finish() override { return command("finish"); }

  Result<> still() override { return command("still"); }

  Result<> undo() override { return command("undo"); }

  Result<> cancel_model() override { return command("cancel"); }

  Result<std::vector<SessionInfo>> sessions() override;
  Result<> continue_session(const std::string& id) override;
  Result<> remove_session(const std::string& id) override;
  Result<ExportReport> export_session(const std::string& id,
                                      const std::filesystem::path& destination) override;
  Result<std::vector<DeviceInfo>> devices() override;

  /// What it was asked so far: "start", "remove ID", "export ID DESTINATION".
  [[nodiscard]] std::vector<std::string> asked() const;

  void set_status(const ControlStatus& status);
  /// What the next commands are answered with; nothing: they succeed.
  void refuse_with(std::optional<Error> error);
  /// Called with each command, in the server's thread, after it is noted and before it is answered.
  void on_command(std::function<void(const std::string&)> hook);
  /// Called, in the server's thread, before the status is told.
  void on_status(std::function<void()> hook);

 private:
  Result<> command(const std::string& what);

  mutable std::mutex mutex_;
  std::vector<std::string> asked_;
  ControlStatus status_;
  std::optional<Error> refusal_;
  std::function<void(const std::string&)> hook_;
  std::function<void()> status_hook_;
};

/// A FakeRig behind a real server on a socket.
class ServedRig {
 public:
  explicit ServedRig(const ControlOptions& options);
  ~ServedRig();
  ServedRig(const ServedRig&) = delete;
  ServedRig& operator=(const ServedRig&) = delete;
  ServedRig(ServedRig&&) = delete;
  ServedRig& operator=(ServedRig&&) = delete;

  [[nodiscard]] FakeRig& rig() { return rig_; }

  [[nodiscard]] ControlServer& server() { return *server_; }

  /// Ends the server; again: nothing.
  void stop();

 private:
  FakeRig rig_;
  std::unique_ptr<ControlServer> server_;
  std::jthread thread_;
};

}  // namespace trigmesh::test_support
