#include "tests/integration/run_program.hpp"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace trigmesh::test_support {
namespace {

using Clock = std::chrono::steady_clock;

/// The environment of this program with QT_QPA_PLATFORM=offscreen.
std::vector<std::string> child_environment() {
  std::vector<std::string> variables;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    if (std::strncmp(*variable, "QT_QPA_PLATFORM=", 16) != 0) {
      variables.emplace_back(*variable);
    }
  }
  variables.emplace_back("QT_QPA_PLATFORM=offscreen");
  return variables;
}

std::vector<char*> pointers_to(std::vector<std::string>& strings) {
  std::vector<char*> pointers;
  for (std::string& string : strings) {
    pointers.push_back(string.data());
  }
  pointers.push_back(nullptr);
  return pointers;
}

/// Appends what can be read now; closes the descriptor (-1) at its end.
void drain(pollfd& source, std::string& text) {
  if (source.fd < 0 || source.revents == 0) {
    return;
  }
  std::array<char, 4096> chunk;
  const ssize_t got = ::read(source.fd, chunk.data(), chunk.size());
  if (got > 0) {
    text.append(chunk.data(), static_cast<std::size_t>(got));
  } else if (got == 0 || errno != EINTR) {
    (void)::close(source.fd);
    source.fd = -1;
  }
}

/// Reads both pipes until the child has closed them, or kills the child at the deadline.
void collect(pid_t child, int out, int err, Clock::time_point deadline, ProgramResult& result) {
  std::array<pollfd, 2> sources{pollfd{out, POLLIN, 0}, pollfd{err, POLLIN, 0}};
  while (sources[0].fd >= 0 || sources[1].fd >= 0) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    if (left <= 0 || ::poll(sources.data(), sources.size(), static_cast<int>(left)) == 0) {
      (void)::kill(child, SIGKILL);
      deadline = Clock::time_point::max() - std::chrono::hours(1);
      continue;
    }
    drain(sources[0], result.out);
    drain(sources[1], result.err);
  }
}

}  // namespace

ProgramResult run_program(const std::vector<std::string>& command,
                          std::chrono::seconds time_limit) {
  ProgramResult result;
  std::array<int, 2> out{};
  std::array<int, 2> err{};
  if (::pipe2(out.data(), O_CLOEXEC) != 0 || ::pipe2(err.data(), O_CLOEXEC) != 0) {
    result.err = "cannot make a pipe";
    return result;
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err[1], STDERR_FILENO);
  std::vector<std::string> arguments = command;
  std::vector<std::string> environment = child_environment();
  pid_t child = 0;
  const int failed = ::posix_spawnp(&child,
                                    command.front().c_str(),
                                    &actions,
                                    nullptr,
                                    pointers_to(arguments).data(),
                                    pointers_to(environment).data());
  posix_spawn_file_actions_destroy(&actions);
  (void)::close(out[1]);
  (void)::close(err[1]);
  if (failed != 0) {
    (void)::close(out[0]);
    (void)::close(err[0]);
    result.exit_code = 127;
    result.err = std::strerror(failed);
    return result;
  }
  collect(child, out[0], err[0], Clock::now() + time_limit, result);
  int status = 0;
  (void)::waitpid(child, &status, 0);
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return result;
}

ProgramResult run_trigmesh(std::vector<std::string> arguments, std::chrono::seconds time_limit) {
  arguments.insert(arguments.begin(), program_path());
  return run_program(arguments, time_limit);
}

std::string program_path() {
  return TRIGMESH_PROGRAM;
}

std::optional<std::filesystem::path> find_program(const std::string& name) {
  const char* search = std::getenv("PATH");
  std::istringstream folders(search == nullptr ? "" : search);
  for (std::string folder; std::getline(folders, folder, ':');) {
    const std::filesystem::path candidate = std::filesystem::path(folder) / name;
    if (::access(candidate.c_str(), X_OK) == 0) {
      return candidate;
    }
  }
  return std::nullopt;
}

std::filesystem::path source_path(const std::filesystem::path& relative) {
  return std::filesystem::path(TRIGMESH_SOURCE_DIR) / relative;
}

std::string contents(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

std::map<std::string, std::string> all_files(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) {
      files[std::filesystem::relative(entry.path(), folder).string()] = contents(entry.path());
    }
  }
  return files;
}

}  // namespace trigmesh::test_support
