#include "tests/integration/running_service.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace trigmesh::test_support {
namespace {

using Clock = std::chrono::steady_clock;

int milliseconds_until(Clock::time_point limit) {
  const auto left =
      std::chrono::duration_cast<std::chrono::milliseconds>(limit - Clock::now()).count();
  return static_cast<int>(std::max<std::int64_t>(left, 0));
}

int listen_at(const std::filesystem::path& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof(address.sun_path) - 1);
  const int fd = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  EXPECT_EQ(::bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0)
      << std::strerror(errno);
  return fd;
}

std::vector<char*> pointers_to(std::vector<std::string>& strings) {
  std::vector<char*> pointers;
  for (std::string& string : strings) {
    pointers.push_back(string.data());
  }
  pointers.push_back(nullptr);
  return pointers;
}

pid_t spawn(std::vector<std::string> command,
            std::vector<std::string> environment,
            const std::filesystem::path& log) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(
      &actions, STDERR_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
  pid_t child = -1;
  const int failed = ::posix_spawnp(&child,
                                    command.front().c_str(),
                                    &actions,
                                    nullptr,
                                    pointers_to(command).data(),
                                    pointers_to(environment).data());
  posix_spawn_file_actions_destroy(&actions);
  EXPECT_EQ(failed, 0) << std::strerror(failed);
  return child;
}

/// The environment of this program, and where to tell.
std::vector<std::string> environment_with(const std::filesystem::path& notify_socket,
                                          std::chrono::microseconds watchdog) {
  std::vector<std::string> variables;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    variables.emplace_back(*variable);
  }
  variables.push_back(fmt::format("NOTIFY_SOCKET={}", notify_socket.string()));
  variables.push_back(fmt::format("WATCHDOG_USEC={}", watchdog.count()));
  return variables;
}

}  // namespace

RunningService::RunningService(const std::vector<std::string>& command,
                               const std::filesystem::path& notify_socket,
                               const std::filesystem::path& log,
                               std::chrono::microseconds watchdog)
    : notify_(listen_at(notify_socket)),
      process_([&] {
        pid_ = spawn(command, environment_with(notify_socket, watchdog), log);
        return static_cast<int>(::syscall(SYS_pidfd_open, pid_, 0));
      }()),
      reader_([this] { listen(); }) {}

RunningService::~RunningService() {
  if (pid_ > 0) {
    (void)::kill(pid_, SIGKILL);
    (void)::waitpid(pid_, nullptr, 0);
  }
  // Ends the reader's recv; a datagram socket without a peer says so and does it nevertheless.
  (void)::shutdown(notify_.get(), SHUT_RD);
}

/// All the time: a service whose manager does not listen waits in the end.
void RunningService::listen() {
  std::array<char, 4096> message;
  while (true) {
    const ssize_t size = ::recv(notify_.get(), message.data(), message.size(), 0);
    if (size <= 0) {
      return;
    }
    {
      const std::lock_guard lock(mutex_);
      told_.append(message.data(), static_cast<std::size_t>(size));
      told_ += '\n';
    }
    heard_.notify_all();
  }
}

bool RunningService::await_told(const std::string& text, std::chrono::seconds limit) {
  std::unique_lock lock(mutex_);
  return heard_.wait_for(lock, limit, [&] { return told_.find(text) != std::string::npos; });
}

void RunningService::send_signal(int number) const {
  EXPECT_EQ(::kill(pid_, number), 0) << std::strerror(errno);
}

int RunningService::await_end(std::chrono::seconds limit) {
  pollfd entry{process_.get(), POLLIN, 0};
  if (::poll(&entry, 1, milliseconds_until(Clock::now() + limit)) <= 0) {
    return -1;
  }
  int status = 0;
  (void)::waitpid(pid_, &status, 0);
  pid_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace trigmesh::test_support
