#include "tools/trigmesh/command.hpp"

#include <cstdio>

namespace trigmesh {

int exit_code(ErrorCode code) {
  switch (code) {
    case ErrorCode::kInvalidArgument:
      return 2;
    case ErrorCode::kNotFound:
    case ErrorCode::kCorruptData:
    case ErrorCode::kUnsupported:
      return 3;
    case ErrorCode::kInsufficientData:
      return 4;
    case ErrorCode::kIo:
      return 5;
    case ErrorCode::kNoSpace:
      return 6;
    case ErrorCode::kLimitExceeded:
      return 7;
    case ErrorCode::kCancelled:
      return 130;
    case ErrorCode::kInternal:
      return 70;
  }
  return 70;
}

void finish_command(CommandContext& context, const Result<>& result) {
  if (result) {
    context.exit_code = 0;
    return;
  }
  std::fflush(stdout);
  fmt::print(stderr, "trigmesh: {}\n", result.error().message);
  context.exit_code = exit_code(result.error().code);
}

}  // namespace trigmesh
