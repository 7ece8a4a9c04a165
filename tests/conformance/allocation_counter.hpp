#pragma once

#include <cstdint>

namespace trigmesh::conformance {

/// Calls of operator new on this thread since it began. The test program replaces operator new to
/// count them.
[[nodiscard]] std::uint64_t allocations_of_this_thread();

}  // namespace trigmesh::conformance
