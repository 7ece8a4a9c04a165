#pragma once

#include <string>
#include <utility>

#include <fmt/core.h>
#include <tl/expected.hpp>

namespace trigmesh {

/// What the caller can do about a failure. The message of an Error says the rest.
enum class ErrorCode {
  kInvalidArgument,   ///< an option or setting is out of range: correct it and call again
  kNotFound,          ///< a file or folder that was named does not exist
  kCorruptData,       ///< bytes that do not follow their format (truncated, hostile, wrong type)
  kUnsupported,       ///< well-formed, but of a kind that this build does not handle
  kInsufficientData,  ///< valid input from which the result cannot be computed (too few images, no
                      ///< overlap)
  kLimitExceeded,     ///< a declared limit (memory, size, count) would be broken
  kIo,                ///< reading or writing failed: permission, device, file system
  kNoSpace,           ///< the disk or quota is full
  kCancelled,         ///< the caller asked to stop; finished stages are kept
  kInternal,          ///< a library refused what should have been valid
};

/// A run-time failure: what was attempted, on what, and why it failed; lower-case start, no final
/// period.
struct Error {
  ErrorCode code = ErrorCode::kInternal;
  std::string message;
};

/// The return type of everything that can go wrong at run time (STYLE: errors are values).
template <typename T = void>
using Result = tl::expected<T, Error>;

/// Builds the failed side of a Result: `return fail(ErrorCode::kIo, "cannot open {}: {}", path,
/// why);`
template <typename... Args>
[[nodiscard]] tl::unexpected<Error> fail(ErrorCode code,
                                         fmt::format_string<Args...> text,
                                         Args&&... args) {
  return tl::unexpected<Error>(Error{code, fmt::format(text, std::forward<Args>(args)...)});
}

}  // namespace trigmesh
