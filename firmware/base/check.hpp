#pragma once

#include <cstdio>
#include <cstdlib>

#include "firmware/base/result.hpp"

namespace trigmesh::internal {

[[noreturn]] inline void check_failed(const char* condition, const char* file, int line) {
  std::fprintf(stderr, "%s:%d: check failed: %s\n", file, line, condition);
  std::abort();
}

}  // namespace trigmesh::internal

/// Aborts with the location when a precondition inside our own code is broken. Never for external
/// data.
#define TM_CHECK(condition)           \
  ((condition) ? static_cast<void>(0) \
               : ::trigmesh::internal::check_failed(#condition, __FILE__, __LINE__))

#define TM_CONCAT_INNER(a, b) a##b
#define TM_CONCAT(a, b) TM_CONCAT_INNER(a, b)

/// Returns the error of a Result<void> expression from the enclosing function.
#define TM_RETURN_IF_ERROR(expression)                                          \
  do {                                                                          \
    auto tm_result = (expression);                                              \
    if (!tm_result) {                                                           \
      return ::tl::unexpected<::trigmesh::Error>(std::move(tm_result).error()); \
    }                                                                           \
  } while (false)

#define TM_ASSIGN_OR_RETURN_INNER(result, declaration, expression)         \
  auto result = (expression);                                              \
  if (!result) {                                                           \
    return ::tl::unexpected<::trigmesh::Error>(std::move(result).error()); \
  }                                                                        \
  declaration = std::move(result).value()

/// `TM_ASSIGN_OR_RETURN(auto camera, read_camera(path));` binds the value or returns the error.
#define TM_ASSIGN_OR_RETURN(declaration, expression) \
  TM_ASSIGN_OR_RETURN_INNER(TM_CONCAT(tm_result_, __LINE__), declaration, expression)
