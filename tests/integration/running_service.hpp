#pragma once

#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <sys/types.h>

#include "firmware/base/unique_fd.hpp"

namespace trigmesh::test_support {

/// A service that runs beside the test, which stands for its service manager (sd_notify). It is
/// killed when the object goes.
class RunningService {
 public:
  /// Starts `command`. `notify_socket`: a path that does not exist yet. stderr goes to `log`.
  RunningService(const std::vector<std::string>& command,
                 const std::filesystem::path& notify_socket,
                 const std::filesystem::path& log,
                 std::chrono::microseconds watchdog);
  ~RunningService();
  RunningService(const RunningService&) = delete;
  RunningService& operator=(const RunningService&) = delete;
  RunningService(RunningService&&) = delete;
  RunningService& operator=(RunningService&&) = delete;

  /// Waits until it has told this, "READY=1", at any time since it was started; false when it has
  /// not within the time.
  [[nodiscard]] bool await_told(const std::string& text,
                                std::chrono::seconds limit = std::chrono::seconds(60));

  void send_signal(int number) const;

  /// Its exit code, 128 + the signal that ended it, or -1 when it runs on after the time.
  [[nodiscard]] int await_end(std::chrono::seconds limit = std::chrono::seconds(60));

 private:
  void listen();

  pid_t pid_ = -1;
  std::mutex mutex_;
  std::condition_variable heard_;
  std::string told_;  ///< guarded by mutex_: all messages, a line each
  UniqueFd notify_;
  UniqueFd process_;
  std::jthread reader_;  ///< last: it uses all of the above
};

}  // namespace trigmesh::test_support
