#pragma once

#include <cstdint>
#include <optional>

namespace trigmesh::conformance {

/// Calls of operator new on this thread since it began. The test program replaces operator new to
/// count them; nothing in a build with sanitizers, which replace it themselves.
[[nodiscard]] std::optional<std::uint64_t> allocations_of_this_thread();

}  // namespace trigmesh::conformance
