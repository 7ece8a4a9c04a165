#pragma once

#include <string_view>

namespace trigmesh {

/// Why a piece of surface is not good.
enum class GapKind {
  kHole,  ///< there is none: an open border goes around it
  kWeak,  ///< fewer than three views see it, or all of them from nearly the same direction
};

/// "hole", "weak".
[[nodiscard]] constexpr std::string_view to_string(GapKind kind) {
  return kind == GapKind::kHole ? "hole" : "weak";
}

}  // namespace trigmesh
