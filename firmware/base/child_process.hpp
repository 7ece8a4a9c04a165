#pragma once

#include <cstddef>
#include <functional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/base/result.hpp"

namespace trigmesh {

/// A program to run, and what becomes of its words.
struct ChildCommand {
  /// The program, by path or by a name in PATH, and its arguments. No shell sees them: blanks,
  /// quotes and the like mean nothing. Not empty.
  std::vector<std::string> arguments;
  /// Is given what the program writes on its standard output, piece by piece, in the calling
  /// thread. An error ends the program.
  std::function<Result<>(std::string_view)> on_output;
  /// Most bytes kept of its standard error; the rest is read and forgotten.
  std::size_t max_error_bytes = std::size_t{64} << 10U;
};

/// How a program ended.
struct ChildExit {
  int code = 0;             ///< of exit, or 128 + the signal that ended it
  std::string errors;       ///< the beginning of what it wrote on standard error
  bool errors_cut = false;  ///< there was more of it
};

/// Runs a program to its end: nothing on its standard input, a process group of its own (Ctrl-C at
/// a terminal reaches it through `stop` only), no signal blocked. A program that is still there
/// when an error is returned is killed and reaped first. kNotFound: no such program; kCancelled;
/// what on_output returns; kIo: the system has no process or pipe.
[[nodiscard]] Result<ChildExit> run_child(const ChildCommand& command, const std::stop_token& stop);

}  // namespace trigmesh
