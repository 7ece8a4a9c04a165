#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "firmware/session/manifest.hpp"

namespace trigmesh {

/// Which finished sessions may be removed to make room.
struct RetentionRules {
  enum class Removal { kNever, kWhenNeeded };

  /// kNever: the operator removes sessions himself.
  Removal removal = Removal::kNever;
  /// Also sessions of which no model could be made or none was made yet.
  bool without_model = false;
  /// Also sessions of which no verified copy exists.
  bool not_exported = false;

  bool operator==(const RetentionRules&) const = default;
};

/// A session in the list of the store.
struct SessionInfo {
  SessionManifest manifest;
  bool has_model = false;
  std::uint64_t size_bytes = 0;  ///< of all its files
};

/// Whether the rules let this one go: never one that is open or whose model is being made.
[[nodiscard]] bool may_be_removed(const SessionInfo& session, const RetentionRules& rules);

/// Ids of the sessions to remove, the oldest first, until `needed_bytes` are gained or no more may
/// go. `sessions` sorted by id.
[[nodiscard]] std::vector<std::string> choose_victims(std::span<const SessionInfo> sessions,
                                                      const RetentionRules& rules,
                                                      std::uint64_t needed_bytes);

}  // namespace trigmesh
