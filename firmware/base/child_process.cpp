#include "firmware/base/child_process.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <optional>
#include <span>
#include <system_error>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/eventfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include "firmware/base/check.hpp"
#include "firmware/base/unique_fd.hpp"

namespace trigmesh {
namespace {

std::string reason(int error_number) {
  return std::generic_category().message(error_number);
}

/// Both ends of a pipe; the child gets copies of what it needs, so none of them reaches it.
struct Pipe {
  explicit Pipe(const std::array<int, 2>& ends) : read_end(ends[0]), write_end(ends[1]) {}

  Pipe() : Pipe(make()) {}

  static std::array<int, 2> make() {
    std::array<int, 2> ends{-1, -1};
    (void)::pipe2(ends.data(), O_CLOEXEC);  // leaves -1 when it fails
    return ends;
  }

  UniqueFd read_end;
  UniqueFd write_end;
};

/// What posix_spawn is told besides the arguments.
class SpawnSettings {
 public:
  SpawnSettings(int out, int err) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions_, out, STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions_, err, STDERR_FILENO);
    sigset_t none;
    sigemptyset(&none);
    sigset_t defaulted = none;
    for (const int signal : {SIGINT, SIGTERM, SIGPIPE}) {
      sigaddset(&defaulted, signal);
    }
    posix_spawnattr_init(&attributes_);
    posix_spawnattr_setsigmask(&attributes_, &none);
    posix_spawnattr_setsigdefault(&attributes_, &defaulted);
    posix_spawnattr_setpgroup(&attributes_, 0);
    posix_spawnattr_setflags(
        &attributes_, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
  }

  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;
  SpawnSettings(SpawnSettings&&) = delete;
  SpawnSettings& operator=(SpawnSettings&&) = delete;

  ~SpawnSettings() {
    posix_spawnattr_destroy(&attributes_);
    posix_spawn_file_actions_destroy(&actions_);
  }

  [[nodiscard]] Result<pid_t> spawn(std::vector<std::string> arguments) const {
    std::vector<char*> pointers;
    pointers.reserve(arguments.size() + 1);
    for (std::string& argument : arguments) {
      pointers.push_back(argument.data());
    }
    pointers.push_back(nullptr);
    pid_t child = -1;
    const int failed =
        ::posix_spawnp(&child, pointers.front(), &actions_, &attributes_, pointers.data(), environ);
    if (failed != 0) {
      return fail(failed == ENOENT ? ErrorCode::kNotFound : ErrorCode::kIo,
                  "cannot run {}: {}",
                  arguments.front(),
                  reason(failed));
    }
    return child;
  }

 private:
  posix_spawn_file_actions_t actions_{};
  posix_spawnattr_t attributes_{};
};

/// A running program; killed and reaped if nobody waited for it.
class Child {
 public:
  explicit Child(pid_t id) : id_(id) {}

  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  Child(Child&&) = delete;
  Child& operator=(Child&&) = delete;

  ~Child() {
    if (id_ > 0) {
      (void)::kill(-id_, SIGKILL);  // with what it started; cannot fail before it is reaped
      (void)wait();
    }
  }

  /// The exit code, or 128 + the signal.
  int wait() {
    int status = 0;
    while (::waitpid(id_, &status, 0) < 0 && errno == EINTR) {
    }
    id_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

 private:
  pid_t id_;
};

/// Reads both outputs of a program until it has closed them.
class OutputReader {
 public:
  OutputReader(const ChildCommand& command, int out, int err, int stop_event)
      : command_(command),
        watched_{pollfd{out, POLLIN, 0}, pollfd{err, POLLIN, 0}, pollfd{stop_event, POLLIN, 0}} {}

  Result<> read_all(ChildExit& exit) {
    while (watched_[0].fd >= 0 || watched_[1].fd >= 0) {
      if (::poll(watched_.data(), watched_.size(), -1) < 0) {
        continue;  // interrupted by a signal
      }
      if ((watched_[2].revents & POLLIN) != 0) {
        return fail(ErrorCode::kCancelled, "stopped while {} ran", command_.arguments.front());
      }
      if (const auto piece = read_from(watched_[0]); !piece.empty() && command_.on_output) {
        TM_RETURN_IF_ERROR(command_.on_output(piece));
      }
      keep_errors(read_from(watched_[1]), exit);
    }
    return {};
  }

 private:
  /// What there is; closes the entry at the end.
  std::string_view read_from(pollfd& source) {
    if (source.fd < 0 || source.revents == 0) {
      return {};
    }
    const ssize_t got = ::read(source.fd, room_.data(), room_.size());
    if (got > 0) {
      return {room_.data(), static_cast<std::size_t>(got)};
    }
    if (got == 0 || errno != EINTR) {
      source.fd = -1;
      source.revents = 0;
    }
    return {};
  }

  void keep_errors(std::string_view piece, ChildExit& exit) const {
    const std::size_t room = command_.max_error_bytes - exit.errors.size();
    exit.errors.append(piece.substr(0, room));
    exit.errors_cut = exit.errors_cut || piece.size() > room;
  }

  const ChildCommand& command_;
  std::array<pollfd, 3> watched_;
  std::array<char, 16384> room_{};
};

}  // namespace

Result<ChildExit> run_child(const ChildCommand& command, const std::stop_token& stop) {
  TM_CHECK(!command.arguments.empty());
  Pipe out;
  Pipe err;
  const UniqueFd stop_event(::eventfd(0, EFD_CLOEXEC));
  if (!out.read_end.valid() || !err.read_end.valid() || !stop_event.valid()) {
    return fail(
        ErrorCode::kIo, "cannot make a pipe to {}: {}", command.arguments.front(), reason(errno));
  }
  const std::stop_callback wake(stop, [&stop_event] {
    const std::uint64_t one = 1;
    (void)!::write(stop_event.get(), &one, sizeof one);  // fails only when the flag is set
  });
  TM_ASSIGN_OR_RETURN(
      const pid_t id,
      SpawnSettings(out.write_end.get(), err.write_end.get()).spawn(command.arguments));
  Child child(id);
  // Only the child holds them now, so that reading ends when it ends.
  (void)out.write_end.close();
  (void)err.write_end.close();
  ChildExit exit;
  OutputReader reader(command, out.read_end.get(), err.read_end.get(), stop_event.get());
  TM_RETURN_IF_ERROR(reader.read_all(exit));
  exit.code = child.wait();
  return exit;
}

}  // namespace trigmesh
